// Judges each reading before anything is computed from it, and says how much of the force a device
// may show.
#pragma once

#include "haptics/device.h"

namespace viscera {

struct GuardSettings {
  double fade_time = 0.05;       ///< [s] from full force to none
  double settle_time = 0.1;      ///< [s] of sound readings before force comes back
  double engage_time = 0.2;      ///< [s] from none to full force
  double greatest_speed = 3.0;   ///< [m/s] of a hand; faster is a jump
  double outside_margin = 0.02;  ///< [m] around the work space in which a reading is still believed
  /// [s] without a tick after which force goes to zero, by the watchdog where there is one. Longer
  /// than a busy machine keeps an ordinary thread waiting, shorter than a hand takes to notice.
  double tick_timeout = 0.03;
};

/// After a fault the force fades, stays away until readings have been sound for a while, and then
/// rises slowly: a device that comes back inside an organ isn't thrown out of it. The same path is
/// taken at the start.
class DeviceGuard {
 public:
  DeviceGuard(const GuardSettings& settings, const DeviceLimits& limits, double dt);

  enum class Phase { kAway, kEngaged, kFading };

  /// Judges this tick's reading; reports a fault once, when it begins. `elapsed` [s] since the last
  /// tick: force falls by it, but rises by a tick's share alone.
  void judge(const DeviceState& state, std::uint64_t tick, double elapsed, ServoEventRing& events);
  /// Something else than the device failed, or the loop ends: the same path.
  void fault(ServoEventKind kind, std::uint64_t tick, ServoEventRing& events, double value = 0.0);
  /// Once released, force doesn't come back.
  void release(std::uint64_t tick, ServoEventRing& events);

  Phase phase() const { return state_.phase; }
  /// [0, 1] of the force that may be shown now.
  double authority() const { return state_.authority; }
  /// Has just begun to engage: forget what was before.
  bool just_engaged() const { return state_.just_engaged; }
  /// The reading that was judged last is sound.
  bool sound() const { return sound_; }
  /// The last sound reading.
  const DeviceState& reading() const { return state_.reading; }

  struct State {
    Phase phase = Phase::kAway;
    double authority = 0.0;
    std::uint64_t sound_ticks = 0;
    bool just_engaged = false, released = false, faulty = false;
    ServoEventKind fault = ServoEventKind::kEngaged;  ///< the last one reported
    DeviceState reading;
    /// The last finite reading, sound or not, which the next is compared with.
    bool known = false, comparable = false;
    DeviceState previous;
    std::uint64_t sampled_at = 0;  ///< tick at which it came
    static constexpr auto fields() {
      return std::tuple(
          field("phase", &State::phase), field("authority", &State::authority),
          field("sound_ticks", &State::sound_ticks), field("just_engaged", &State::just_engaged),
          field("released", &State::released), field("faulty", &State::faulty),
          field("fault", &State::fault), field("reading", &State::reading),
          field("known", &State::known), field("comparable", &State::comparable),
          field("previous", &State::previous), field("sampled_at", &State::sampled_at));
    }
  };
  const State& state() const { return state_; }
  void restore(const State& state) { state_ = state; }
  static bool fits(const State& state) {
    return state.phase >= Phase::kAway && state.phase <= Phase::kFading && is_kind(state.fault);
  }

 private:
  bool sound(const DeviceState& state, std::uint64_t tick, ServoEvent& fault) const;
  void fade();

  GuardSettings settings_;
  DeviceLimits limits_;
  double dt_;
  std::uint64_t settle_ticks_;
  bool sound_ = false;  // of this tick alone: no state
  State state_;
};
static_assert(fields_cover<DeviceGuard::State>() && StateOwner<DeviceGuard>);

}  // namespace viscera
