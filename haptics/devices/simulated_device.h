// A PHANToM Premium 1.0A and the hand that holds it, by their equations of motion.
#pragma once

#include <array>
#include <atomic>

#include "haptics/device.h"
#include "haptics/devices/hand.h"

namespace viscera {

/// The figures that the maker published for the Premium 1.0 [SensAble2000], the design of
/// [Massie1994]; recalled, not read off a data sheet here. The work space's corner is the origin's:
/// the box is centred.
DeviceLimits phantom_premium_1_0a();

struct SimulatedDeviceSettings {
  DeviceLimits limits = phantom_premium_1_0a();
  Hand hand = Hand::with_grip(0.5);
  HandPath path;     ///< in the device's frame
  double dt = 1e-3;  ///< [s] of a tick
};

/// Closes the loop: handle and hand are one mass under the motors' force, the hand's spring and
/// damper, and Coulomb's friction in the joints; the force is held over a tick, positions are
/// rounded to the encoders' step, the work space ends in stops that don't bounce. A tick is ten
/// implicit steps, which lose some energy: 1e-4 s times the hand's stiffness as damping, a
/// hundredth of the hand's own. The joints have no viscous friction: the least favourable case.
class SimulatedDevice : public HapticDevice {
 public:
  explicit SimulatedDevice(SimulatedDeviceSettings settings);

  const std::string& name() const override { return name_; }
  const DeviceLimits& limits() const override { return settings_.limits; }
  DeviceState read(std::uint64_t tick) noexcept override;
  void write(const Vec3& force) noexcept override;

  /// Where the handle really is [m], between the encoders' steps.
  const Vec3& position() const { return state_.position; }
  const Vec3& velocity() const { return state_.velocity; }

  /// Handle and hand; where the hand wants to be follows from the tick.
  struct State {
    Vec3 position = Vec3::Zero(), velocity = Vec3::Zero(), force = Vec3::Zero();
    bool started = false;
    std::uint64_t tick = 0;
    static constexpr auto fields() {
      return std::tuple(field("position", &State::position), field("velocity", &State::velocity),
                        field("force", &State::force), field("started", &State::started),
                        field("tick", &State::tick));
    }
  };
  State state() const;
  void restore(const State& state);
  bool fits(const State& state) const;

  std::string why_not_saved() const override { return {}; }
  std::vector<std::byte> state_bytes() const override;
  bool fits_bytes(std::span<const std::byte> bytes) const override;
  void restore_bytes(std::span<const std::byte> bytes) override;

 private:
  void advance(double from);
  void hold(const Vec3& given);
  Vec3 written() const;

  std::string name_ = "simulated";
  SimulatedDeviceSettings settings_;
  State state_;
  /// state_.force from the next read() on: that may be under way on another thread.
  std::array<std::atomic<double>, 3> written_{};
};
static_assert(fields_cover<SimulatedDevice::State>() && StateOwner<SimulatedDevice>);

}  // namespace viscera
