#include "haptics/devices/hand.h"

#include <algorithm>
#include <cmath>

namespace viscera {

Hand Hand::with_grip(double grip) {
  constexpr Hand kLoose{0.02, 30.0, 0.5}, kFirm{0.2, 1000.0, 12.0};
  const auto between = [&](double loose, double firm) {
    return loose * std::pow(firm / loose, std::clamp(grip, 0.0, 1.0));
  };
  return {between(kLoose.mass, kFirm.mass), between(kLoose.stiffness, kFirm.stiffness),
          between(kLoose.damping, kFirm.damping)};
}

HandPath::At HandPath::at(double time) const {
  if (keys.empty()) return {};
  const auto rest = [](const Key& key) { return At{key.pose, Vec3::Zero(), key.buttons}; };
  if (time <= keys.front().time) return rest(keys.front());
  if (time >= keys.back().time) return rest(keys.back());
  const auto next = std::upper_bound(keys.begin(), keys.end(), time,
                                     [](double t, const Key& key) { return t < key.time; });
  const Key &from = *(next - 1), &to = *next;
  const double lasts = to.time - from.time, s = (time - from.time) / lasts;
  const double share = sampled ? s : s * s * s * (10.0 + s * (-15.0 + 6.0 * s));
  const double rate = sampled ? 1.0 / lasts : s * s * (30.0 + s * (-60.0 + 30.0 * s)) / lasts;
  const Vec3 way = to.pose.position - from.pose.position;
  return {
      {from.pose.position + share * way, from.pose.orientation.slerp(share, to.pose.orientation)},
      rate * way,
      from.buttons};
}

}  // namespace viscera
