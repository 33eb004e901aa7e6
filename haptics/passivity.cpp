#include "haptics/passivity.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace viscera {

namespace {

/// Of the encoders' step: more than one along an axis.
constexpr double kOneStep = 1.2;

}  // namespace

PassivityGuard::PassivityGuard(const PassivitySettings& settings, const DeviceLimits& limits,
                               double dt)
    : settings_(settings),
      dt_(dt),
      smoothing_(1.0 - std::exp(-2.0 * std::numbers::pi * settings.velocity_cut * dt)),
      friction_(limits.friction),
      one_step_(kOneStep * limits.resolution),
      greatest_damping_(settings.greatest_share * limits.apparent_mass * 2.0 * std::numbers::pi *
                        settings.velocity_cut),
      // What positions known to a step can't tell: some steps under a lasting force.
      tolerance_(10.0 * limits.continuous_force * limits.resolution) {}

void PassivityGuard::reset(const Vec3& device) {
  device_ = device;
  velocity_ = Vec3::Zero();
  stored_ = -1.0;
  budget_ = 0.0;
  damping_ = 0.0;
}

Vec3 PassivityGuard::update(const Vec3& held, const Step& step) {
  const Vec3 moved = step.device - device_;
  device_ = step.device;
  velocity_ += smoothing_ * (moved / dt_ - velocity_);
  const double work = held.dot(moved);
  given_ += work;
  const bool reference = step.stored >= 0.0 && stored_ >= 0.0;
  const double rise = reference ? step.stored - stored_ : 0.0;
  stored_ = step.stored;
  damping_ = 0.0;
  if (!step.judged) return Vec3::Zero();

  budget_ += -work + step.supplied - rise;
  if (moved.norm() < one_step_) budget_ += friction_ * moved.norm();
  // Without a reference the budget has to hold all that the tissue stores.
  if (reference) budget_ = std::min(budget_, tolerance_);
  if (budget_ >= 0.0) return Vec3::Zero();
  if (budget_ < -tolerance_) ++violations_;
  const double speed2 = velocity_.squaredNorm();
  if (!settings_.control || speed2 == 0.0) return Vec3::Zero();
  damping_ = std::min(-budget_ / (dt_ * speed2), greatest_damping_);
  return -damping_ * velocity_;
}

}  // namespace viscera
