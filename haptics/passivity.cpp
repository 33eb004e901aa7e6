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
  state_.share = 1.0;
  state_.seen = true;
}

/// Work of the held force on the hand [J].
double PassivityGuard::book(const Vec3& held, const Vec3& device, double dt) {
  const Vec3 moved = device - state_.device;
  state_.device = device;
  const double smoothing =
      dt == dt_ ? smoothing_
                : 1.0 - std::exp(-2.0 * std::numbers::pi * settings_.velocity_cut * dt);
  state_.velocity += smoothing * (moved / dt - state_.velocity);
  const double work = held.dot(moved);
  state_.given += work;
  return work;
}

/// Takes what the budget lacks in a tick as long as this one was [N].
Vec3 PassivityGuard::damp(double dt) {
  state_.damping = 0.0;
  if (state_.budget >= 0.0) return Vec3::Zero();
  if (state_.budget < -tolerance_) ++state_.violations;
  const double speed2 = state_.velocity.squaredNorm();
  if (!settings_.control || speed2 == 0.0) return Vec3::Zero();
  state_.damping = std::min(-state_.budget / (dt * speed2), greatest_damping_);
  return -state_.damping * state_.velocity;
}

Vec3 PassivityGuard::update(const Vec3& held, const Step& step) {
  const double moved = (step.device - state_.device).norm();
  const double work = book(held, step.device, step.dt);
  const bool reference = step.stored >= 0.0 && state_.stored >= 0.0;
  double rise = reference ? step.stored - state_.stored : 0.0;
  // What was stored until now is the hand's own, though nobody knows it any more.
  if (step.stored < 0.0 && state_.stored > 0.0) rise = -state_.stored;
  state_.stored = step.stored;

  const double before = state_.budget;
  state_.budget += -work + state_.share * step.supplied - state_.share * rise;
  if (step.full && moved < one_step_) state_.budget += friction_ * moved;
  // Without a reference the budget has to hold all that the tissue stores.
  if (reference) state_.budget = std::min(state_.budget, tolerance_);
  if (reference && !step.full) state_.budget = std::min(state_.budget, std::max(0.0, before));
  return damp(step.dt);
}

Vec3 PassivityGuard::fade(const Vec3& held, const Vec3& device, double dt) {
  if (!state_.seen) {
    state_.device = device;
    state_.velocity = Vec3::Zero();
    state_.seen = true;
    return Vec3::Zero();
  }
  state_.stored *= state_.stored > 0.0 ? state_.share : 1.0;
  state_.share = 1.0;
  const double work = book(held, device, dt);
  const double given_back = std::clamp(work, 0.0, std::max(0.0, state_.stored));
  state_.stored -= given_back;
  state_.budget = std::min(state_.budget + given_back - work, tolerance_);
  return damp(dt);
}

void PassivityGuard::lose_sight() {
  state_.seen = false;
  state_.damping = 0.0;
}

}  // namespace viscera
