#include "haptics/force_limits.h"

#include <algorithm>
#include <cmath>

namespace viscera {

ForceLimits::ForceLimits(const ForceLimitSettings& settings, const DeviceLimits& limits, double dt)
    : peak_(limits.peak_force),
      continuous_(limits.continuous_force),
      step_(limits.peak_force * dt / settings.rise_time),
      heating_(1.0 - std::exp(-dt / settings.heat_time)) {}

Vec3 ForceLimits::apply(const Vec3& wanted) {
  // Cold motors bear the peak, motors as hot as the continuous force makes them bear just that;
  // in between the bound moves steadily, so that no step is felt.
  const double heat = state_.mean_square / (continuous_ * continuous_);
  const double bound = continuous_ + (peak_ - continuous_) * std::clamp(1.0 - heat, 0.0, 1.0);
  Vec3 force = wanted;
  state_.limited = false;
  if (const double size = force.norm(); size > bound) {
    force *= bound / size;
    state_.limited = true;
  }
  const Vec3 change = force - state_.force;
  if (const double size = change.norm(); size > step_) {
    force = state_.force + change * (step_ / size);
    state_.limited = true;
  }
  state_.force = force;
  state_.mean_square += heating_ * (force.squaredNorm() - state_.mean_square);
  return force;
}

}  // namespace viscera
