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
  state_.device = device;
  state_.velocity = Vec3::Zero();
  state_.stored = -1.0;
  state_.budget = 0.0;
  state_.damping = 0.0;
}

Vec3 PassivityGuard::update(const Vec3& held, const Step& step) {
  const Vec3 moved = step.device - state_.device;
  state_.device = step.device;
  state_.velocity += smoothing_ * (moved / dt_ - state_.velocity);
  const double work = held.dot(moved);
  state_.given += work;
  const bool reference = step.stored >= 0.0 && state_.stored >= 0.0;
  const double rise = reference ? step.stored - state_.stored : 0.0;
  state_.stored = step.stored;
  state_.damping = 0.0;
  if (!step.judged) return Vec3::Zero();

  state_.budget += -work + step.supplied - rise;
  if (moved.norm() < one_step_) state_.budget += friction_ * moved.norm();
  // Without a reference the budget has to hold all that the tissue stores.
  if (reference) state_.budget = std::min(state_.budget, tolerance_);
  if (state_.budget >= 0.0) return Vec3::Zero();
  if (state_.budget < -tolerance_) ++state_.violations;
  const double speed2 = state_.velocity.squaredNorm();
  if (!settings_.control || speed2 == 0.0) return Vec3::Zero();
  state_.damping = std::min(-state_.budget / (dt_ * speed2), greatest_damping_);
  return -state_.damping * state_.velocity;
}

}  // namespace viscera
