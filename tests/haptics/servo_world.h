// A simulated hand on a device, a body to touch and the loop between them, on the logical clock.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "haptics/devices/simulated_device.h"
#include "haptics/servo_tick.h"
#include "haptics/virtual_wall.h"

namespace viscera::test {

/// A path along z [m] through (time, z), buttons off.
HandPath path_along_z(const std::vector<std::pair<double, double>>& keys);

/// A wall whose surface is z = 0.
VirtualWall wall_at_zero(double stiffness, double damping = 0.0);

/// Passes a device through, and lets a test break what it reads.
class BrokenDevice : public HapticDevice {
 public:
  using Break = std::function<void(DeviceState&, std::uint64_t tick)>;
  BrokenDevice(HapticDevice& inner, Break how) : inner_(inner), how_(std::move(how)) {}

  const std::string& name() const override { return inner_.name(); }
  const DeviceLimits& limits() const override { return inner_.limits(); }
  DeviceState read(std::uint64_t tick) noexcept override {
    DeviceState state = inner_.read(tick);
    how_(state, tick);
    return state;
  }
  void write(const Vec3& force) noexcept override { inner_.write(force); }

 private:
  HapticDevice& inner_;
  Break how_;
};

/// Runs ticks [from, to) and returns what each left.
std::vector<ServoOutput> run_ticks(ServoTick& servo, std::uint64_t from, std::uint64_t to);

/// All events that are waiting.
std::vector<ServoEvent> take_events(ServoEventRing& events);
bool has_event(const std::vector<ServoEvent>& events, ServoEventKind kind);

/// Greatest change of force from one tick to the next [N].
double greatest_step(const std::vector<ServoOutput>& outputs);

}  // namespace viscera::test
