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

  /// The nearest force to the wanted one that is allowed now; what isn't finite comes back as it
  /// is. The last force was held for `ticks`.
  Vec3 apply(const Vec3& wanted, std::uint64_t ticks = 1);

  enum class Verdict { kSound, kNotFinite, kTooLarge };
  /// Whether the device may be given this force [N], whoever made it: finite, not above the peak,
  /// and where motors are hot not above what they bear for any time.
  Verdict judge(const Vec3& force) const;

  /// The device holds no force. What heated its motors stays; a heat that is no number counts as
  /// what the continuous force makes them.
  void reset();
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
  double peak_, continuous_, step_, heating_, ticks_to_heat_;
  State state_;
};
static_assert(fields_cover<ForceLimits::State>() && StateOwner<ForceLimits>);

}  // namespace viscera
