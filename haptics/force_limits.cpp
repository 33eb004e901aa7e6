#include "haptics/force_limits.h"

#include <algorithm>
#include <cmath>

namespace viscera {
namespace {

/// Above a limit by less than this share is rounding, or a tick that came late.
constexpr double kRounding = 1e-9, kLate = 0.05;

}  // namespace

ForceLimits::ForceLimits(const ForceLimitSettings& settings, const DeviceLimits& limits, double dt)
    : peak_(limits.peak_force),
      continuous_(limits.continuous_force),
      step_(limits.peak_force * dt / settings.rise_time),
      heating_(1.0 - std::exp(-dt / settings.heat_time)),
      ticks_to_heat_(settings.heat_time / dt) {}

Vec3 ForceLimits::apply(const Vec3& wanted, std::uint64_t ticks) {
  if (!wanted.allFinite()) return wanted;
  if (ticks > 1) {
    const double heating = 1.0 - std::exp(-static_cast<double>(ticks - 1) / ticks_to_heat_);
    state_.mean_square += heating * (state_.force.squaredNorm() - state_.mean_square);
  }
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

ForceLimits::Verdict ForceLimits::judge(const Vec3& force) const {
  if (!force.allFinite()) return Verdict::kNotFinite;
  const double size = force.norm();
  // So that a limit that is no number allows nothing.
  if (!(size <= peak_ * (1.0 + kRounding))) return Verdict::kTooLarge;
  const bool hot = !(state_.mean_square <= continuous_ * continuous_ * (1.0 + kLate));
  if (hot && !(size <= continuous_ * (1.0 + kRounding))) return Verdict::kTooLarge;
  return Verdict::kSound;
}

void ForceLimits::reset() {
  state_.force = Vec3::Zero();
  state_.limited = false;
  if (!std::isfinite(state_.mean_square)) state_.mean_square = continuous_ * continuous_;
}

}  // namespace viscera
