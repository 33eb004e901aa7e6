// Watches that the loop gives the hand no energy that it didn't get, and damps when it does.
#pragma once

#include "haptics/device.h"

namespace viscera {

struct PassivitySettings {
  bool control = true;       ///< false: only observe
  double velocity_cut = 50;  ///< [Hz] of the low-pass on the velocity that is damped along
  /// Of apparent mass times the low-pass's corner: a damper that answers faster than its filter
  /// lets it know would pump.
  double greatest_share = 0.1;
};

/// Time-domain passivity [Hannaford2002], with the exact work of a held force [Ryu2004] and the
/// energy stored in tissue and coupling as reference [Ryu2005], so that a leak is seen when it
/// happens and not when all stored energy has been spent:
///
///   budget += -force . step (from the hand) + supplied by the scene - rise of the stored energy
///
/// Held forces leak: half the stiffness times each step's square. What the device's own friction
/// takes pays for that [Abbott2005] where a tick moves no farther than one step of the encoders, so
/// that a resting hand isn't damped for roundings; above, the damper does, and a closed path gives
/// nothing back at the device itself. To ask the tissue half a tick ahead would close the leak as
/// well, but costs a sixth of the stable stiffness under loose hands; this costs none there. The
/// budget never exceeds a small sum, or an honest dissipation now would pay for a rattle later.
/// Below zero, a damper along the motion takes what is missing within the next tick.
///
/// Of a force that is fading in or held back by limits the hand feels a share: so much of what is
/// stored and supplied counts. Such ticks earn nothing. A force that fades out knows no tissue any
/// more; it may give back what was stored when it began to.
class PassivityGuard {
 public:
  PassivityGuard(const PassivitySettings& settings, const DeviceLimits& limits, double dt);

  struct Step {
    Vec3 device;            ///< [m] where the device is now
    double stored = 0.0;    ///< [J] in tissue and coupling; negative: unknown
    double supplied = 0.0;  ///< [J] by the scene's own motion
    double dt = 0.0;        ///< [s] since the last
    bool full = true;       ///< false while force is being limited or faded in
  };
  /// Books the tick that ends now; `held` is the force that acted during it. Returns the force to
  /// add [N].
  Vec3 update(const Vec3& held, const Step& step);
  /// What of the coupling's force the hand is given until the next update [0, 1].
  void show(double share) { state_.share = share; }
  /// Likewise for a tick of `dt` [s] in which force fades out.
  Vec3 fade(const Vec3& held, const Vec3& device, double dt);
  /// Nobody knows where the device is in this tick.
  void lose_sight();
  /// Forgets motion and budget: the device has been away.
  void reset(const Vec3& device);

  double given() const { return state_.given; }  ///< [J] net to the hand since the start
  std::uint64_t violations() const { return state_.violations; }  ///< ticks below the tolerance
  double damping() const { return state_.damping; }               ///< [N s/m] at work now

  struct State {
    Vec3 device = Vec3::Zero(), velocity = Vec3::Zero();
    double stored = -1.0, budget = 0.0, given = 0.0, damping = 0.0, share = 1.0;
    bool seen = true;  ///< `device` is where it was a tick ago
    std::uint64_t violations = 0;
    static constexpr auto fields() {
      return std::tuple(field("device", &State::device), field("velocity", &State::velocity),
                        field("stored", &State::stored), field("budget", &State::budget),
                        field("given", &State::given), field("damping", &State::damping),
                        field("share", &State::share), field("seen", &State::seen),
                        field("violations", &State::violations));
    }
  };
  const State& state() const { return state_; }
  void restore(const State& state) { state_ = state; }

 private:
  double book(const Vec3& held, const Vec3& device, double dt);
  Vec3 damp(double dt);

  PassivitySettings settings_;
  double dt_, smoothing_, friction_, one_step_, greatest_damping_, tolerance_;
  State state_;
};
static_assert(fields_cover<PassivityGuard::State>() && StateOwner<PassivityGuard>);

}  // namespace viscera
