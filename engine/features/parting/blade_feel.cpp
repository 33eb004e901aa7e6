#include "engine/features/parting/blade_feel.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace viscera {
namespace {

/// Of the spring: less stiff than a device's coupling (virtual_coupling.h); chosen [N/m]. A newton
/// takes .7 mm of it.
constexpr double kSpring = 1500.0;
/// Less isn't felt; up to there the spring is as stiff as it says [N].
constexpr double kNone = 1e-3, kStiff = 0.05;

/// Linear between ways, by the angle; `d` across the edge, not zero.
double hold_that_way(const BladeAsFelt& frame, const std::array<double, BladeAsFelt::kWays>& holds,
                     const Vec3& d) {
  const auto [x, y] = frame.across();
  const double turns = std::atan2(d.dot(y), d.dot(x)) / (2.0 * std::numbers::pi);
  const double at = (turns - std::floor(turns)) * static_cast<double>(holds.size());
  const auto first = static_cast<std::size_t>(at) % holds.size();
  const double share = std::clamp(at - static_cast<double>(first), 0.0, 1.0);
  return (1.0 - share) * holds[first] + share * holds[(first + 1) % holds.size()];
}

}  // namespace

std::array<Vec3, 2> BladeAsFelt::across() const {
  const Vec3 x = (side - side.dot(along) * along).normalized();
  return {x, along.cross(x)};
}

Vec3 BladeAsFelt::way(std::size_t k) const {
  const double angle = 2.0 * std::numbers::pi * static_cast<double>(k) / static_cast<double>(kWays);
  const auto [x, y] = across();
  return std::cos(angle) * x + std::sin(angle) * y;
}

TactileForce BladeFeel::respond(const Vec3& tip, double dt) noexcept {
  frames_.update();
  const BladeAsFelt& frame = frames_.front();
  const double share = std::min(1.0, dt / kFrameEasing);
  double greatest = 0.0;
  for (std::size_t k = 0; k < holds_.size(); ++k) {
    holds_[k] += share * (frame.holds[k] - holds_[k]);
    greatest = std::max(greatest, holds_[k]);
  }
  TactileForce felt;
  felt.energy = 0.0;
  if (!(greatest > kNone) || !held_) anchor_ = tip;
  held_ = greatest > kNone;
  if (!held_) return felt;
  const Vec3 carried = dt * frame.velocity;
  anchor_ += carried;
  Vec3 stretch = tip - anchor_;
  stretch -= stretch.dot(frame.along) * frame.along;
  const double stiffness = kSpring * std::min(1.0, greatest / kStiff);
  felt.stiffness = stiffness * (Mat3::Identity() - frame.along * frame.along.transpose());
  if (const double length = stretch.norm(); length > 0.0) {
    const double most = hold_that_way(frame, holds_, stretch) / kSpring;
    if (length > most) {
      // It cuts: no harder for going farther.
      felt.stiffness -= stiffness * (stretch / length) * (stretch / length).transpose();
      stretch *= most / length;
    }
  }
  anchor_ = tip - stretch;
  felt.touching = true;
  felt.force = -kSpring * stretch;
  felt.energy = 0.5 * kSpring * stretch.squaredNorm();
  felt.supplied = std::max(0.0, felt.force.dot(carried));
  return felt;
}

void BladeFeel::restore(State state) {
  frames_.restore(std::move(state.frames));
  anchor_ = state.anchor;
  held_ = state.held;
  holds_ = state.holds;
}

bool BladeFeel::fits(const State& state) {
  const auto sound = [](const std::array<double, BladeAsFelt::kWays>& holds) {
    return std::ranges::all_of(holds,
                               [](double hold) { return hold >= 0.0 && std::isfinite(hold); });
  };
  return TripleBuffer<BladeAsFelt>::fits(state.frames) && state.anchor.allFinite() &&
         sound(state.holds) &&
         std::ranges::all_of(state.frames.slots, [&](const BladeAsFelt& frame) {
           return frame.along.allFinite() && frame.side.allFinite() && frame.velocity.allFinite() &&
                  sound(frame.holds);
         });
}

}  // namespace viscera
