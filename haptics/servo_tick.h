// One tick of the haptic loop: the same code on the wall clock and on the logical one.
#pragma once

#include <array>
#include <cstdint>

#include "haptics/device.h"
#include "haptics/device_guard.h"
#include "haptics/device_pen.h"
#include "haptics/force_limits.h"
#include "haptics/passivity.h"
#include "haptics/tactile_model.h"
#include "haptics/virtual_coupling.h"

namespace viscera {

struct ServoSettings {
  double dt = 1e-3;  ///< [s] of a tick
  Pose placement;    ///< of the device's frame in the scene
  CouplingSettings coupling;
  PassivitySettings passivity;
  ForceLimitSettings force;
  GuardSettings guard;
};

/// The parts of a tick, timed one by one.
enum class TickPart : std::uint8_t { kRead, kTissue, kCoupling, kLimits, kWrite };
constexpr std::size_t kTickParts = 5;
constexpr std::array<const char*, kTickParts> kTickPartNames = {"read", "tissue", "coupling",
                                                                "limits", "write"};
/// [ns] spent in each part.
using TickTimes = std::array<std::uint64_t, kTickParts>;

/// What a tick leaves for others to see, in the scene's frame.
struct ServoOutput {
  std::uint64_t tick = 0;
  Pose device;                 ///< the last sound reading
  Pose tool;                   ///< the coupled tool, which the tissue feels
  Vec3 force = Vec3::Zero();   ///< [N] on the hand
  Vec3 tissue = Vec3::Zero();  ///< [N] of the tissue on the tool
  std::uint32_t buttons = 0;
  bool touching = false;
  double authority = 0.0;  ///< [0, 1] of the force that the device may show (device_guard.h)
  double damping = 0.0;    ///< [N s/m] that keeps the loop passive

  static constexpr auto fields() {
    return std::tuple(
        field("tick", &ServoOutput::tick), field("device", &ServoOutput::device),
        field("tool", &ServoOutput::tool), field("force", &ServoOutput::force),
        field("tissue", &ServoOutput::tissue), field("buttons", &ServoOutput::buttons),
        field("touching", &ServoOutput::touching), field("authority", &ServoOutput::authority),
        field("damping", &ServoOutput::damping));
  }
};
static_assert(fields_cover<ServoOutput>());

/// Reads the device, asks the tissue, couples, limits, writes. Nothing in run() waits, locks,
/// allocates or throws; whoever calls it decides which clock ticks.
///
/// Whatever went wrong before, a force that isn't finite or that the device doesn't bear isn't
/// written: zero is, an event tells, and all that such a number may have got into begins anew.
class ServoTick {
 public:
  ServoTick(HapticDevice& device, TactileModel& tissue, const ServoSettings& settings);

  /// Ticks rise; a late loop may skip some. `times`, where asked for, gets what each part took.
  const ServoOutput& run(std::uint64_t tick, TickTimes* times = nullptr) noexcept;

  /// Lets go: force fades over the next ticks and stays away.
  void release() noexcept { guard_.release(output_.tick, events_); }
  bool released() const { return guard_.phase() == DeviceGuard::Phase::kAway; }
  /// Who may write to the device; for a watchdog.
  DevicePen& pen() { return pen_; }
  /// The device was let go of by another thread; between ticks.
  void forget_force() noexcept;

  const ServoOutput& output() const { return output_; }
  const HapticDevice& device() const { return device_; }
  const ServoSettings& settings() const { return settings_; }
  double energy_given() const { return passivity_.given(); }  ///< [J] net to the hand
  double greatest_force() const { return greatest_force_; }   ///< [N] on the hand since the start
  std::uint64_t passivity_violations() const { return passivity_.violations(); }
  ServoEventRing& events() { return events_; }

  /// Without that of the device and of the tissue, which it doesn't own.
  struct State {
    DeviceGuard::State guard;
    VirtualCoupling::State coupling;
    PassivityGuard::State passivity;
    ForceLimits::State limits;
    ServoEventRing::State events;
    ServoOutput output;
    double greatest_force = 0.0;
    Vec3 tool_before = Vec3::Zero();
    Vec3 fading = Vec3::Zero();  ///< the force when the fault came
    static constexpr auto fields() {
      return std::tuple(field("guard", &State::guard), field("coupling", &State::coupling),
                        field("passivity", &State::passivity), field("limits", &State::limits),
                        field("events", &State::events), field("output", &State::output),
                        field("greatest_force", &State::greatest_force),
                        field("tool_before", &State::tool_before), field("fading", &State::fading));
    }
  };
  State state() const;
  void restore(const State& state);
  static bool fits(const State& state);

 private:
  struct Felt {
    TactileForce tissue;
    Vec3 force = Vec3::Zero();  // on the hand
  };
  Felt feel(const DeviceState& state, const ToolMotion& now, double dt,
            class TickClock& clock) noexcept;
  Vec3 watch_fading(double dt) noexcept;

  HapticDevice& device_;
  DevicePen pen_;
  TactileModel& tissue_;
  ServoSettings settings_;
  DeviceGuard guard_;
  VirtualCoupling coupling_;
  PassivityGuard passivity_;
  ForceLimits limits_;
  ServoEventRing events_;
  ServoOutput output_;
  double greatest_force_ = 0.0;
  Vec3 tool_before_ = Vec3::Zero();
  Vec3 fading_ = Vec3::Zero();
};
static_assert(fields_cover<ServoTick::State>() && StateOwner<ServoTick>);

}  // namespace viscera
