#include "kernels/parting/blade_sweep.h"

#include <algorithm>

#include "kernels/points/closest_on_triangle.h"

namespace viscera {
namespace {

double distance_to(const Vec3& place, const Vec3& a, const Vec3& b, const Vec3& c) {
  const Vec3 w = closest_weights(place, a, b, c);
  return (w[0] * a + w[1] * b + w[2] * c - place).norm();
}

}  // namespace

double BladeSweep::distance(const Vec3& place) const {
  return std::min(distance_to(place, before[0], before[1], now[1]),
                  distance_to(place, before[0], now[1], now[0])) -
         0.5 * thickness;
}

Box BladeSweep::reach() const {
  Box box;
  for (const Vec3& end : before) box.extend(end);
  for (const Vec3& end : now) box.extend(end);
  const Vec3 half = Vec3::Constant(0.5 * thickness);
  return Box(box.min() - half, box.max() + half);
}

double sweep(const BladeSweep& blade, TissueShare& tissue) {
  BladeSweep thick = blade;
  thick.thickness = std::max(blade.thickness, tissue.least_kerf());
  return tissue.take_out(thick.reach(), [&](const Vec3& x) { return thick.distance(x); });
}

}  // namespace viscera
