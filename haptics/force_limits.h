// Keeps the force within what the device can bear and the hand should feel.
#pragma once

#include "haptics/device.h"

namespace viscera {

struct ForceLimitSettings {
  double rise_time = 0.005;  ///< [s] from zero to the peak force, at the fastest
  double heat_time = 10.0;   ///< [s] over which motors feel the mean square of the force
};

/// Peak force, continuous force (motors heat with its square) and rate of change.
class ForceLimits {
 public:
  ForceLimits(const ForceLimitSettings& settings, const DeviceLimits& limits, double dt);

  /// The nearest force to the wanted one that is allowed now.
  Vec3 apply(const Vec3& wanted);
  /// The last apply() changed the force.
  bool limited() const { return state_.limited; }

  struct State {
    double mean_square = 0.0;   ///< [N2]
    Vec3 force = Vec3::Zero();  ///< [N] the last
    bool limited = false;
    static constexpr auto fields() {
      return std::tuple(field("mean_square", &State::mean_square), field("force", &State::force),
                        field("limited", &State::limited));
    }
  };
  const State& state() const { return state_; }
  void restore(const State& state) { state_ = state; }

 private:
  double peak_, continuous_, step_, heating_;
  State state_;
};
static_assert(fields_cover<ForceLimits::State>() && StateOwner<ForceLimits>);

}  // namespace viscera
