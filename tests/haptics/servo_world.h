// A simulated hand on a device, a body to touch and the loop between them, on the logical clock.
#pragma once

#include <utility>
#include <vector>

#include "haptics/devices/simulated_device.h"
#include "haptics/servo_loop.h"
#include "haptics/virtual_wall.h"

namespace viscera::test {

/// A path along z [m] through (time, z), buttons off.
HandPath path_along_z(const std::vector<std::pair<double, double>>& keys);

/// A hand that goes from 10 mm above z = 0 to 10 mm below between these times [s], and stays there.
SimulatedDeviceSettings pressing(double from = 0.2, double until = 0.5);
/// Likewise, sooner: for loops on the wall clock.
inline SimulatedDeviceSettings pressing_soon() {
  return pressing(0.1, 0.3);
}

/// A wall whose surface is z = 0.
VirtualWall wall_at_zero(double stiffness, double damping = 0.0);

/// Moves along z at a steady speed; nobody holds it.
class SteadyDevice : public HapticDevice {
 public:
  SteadyDevice(double from, double speed) : from_(from), speed_(speed) {}
  const std::string& name() const override { return name_; }
  const DeviceLimits& limits() const override { return limits_; }
  DeviceState read(std::uint64_t tick) noexcept override {
    DeviceState state;
    state.pose.position.z() = from_ + speed_ * 1e-3 * static_cast<double>(tick);
    state.sample = tick + 1;
    return state;
  }
  void write(const Vec3&) noexcept override {}

  DeviceLimits limits_ = phantom_premium_1_0a();

 private:
  double from_, speed_;
  std::string name_ = "steady";
};

/// Pushes with one force, wherever the tool is.
class SteadyPush : public TactileModel {
 public:
  explicit SteadyPush(const Vec3& force) { felt_.force = force; }
  TactileForce respond(const ToolMotion&, double) noexcept override { return felt_; }

 private:
  TactileForce felt_;
};

/// No pause between two ticks is a fault, however long a busy machine makes it.
ServoSettings patient();

/// Locked memory and SCHED_FIFO would disturb what else runs on the machine.
ServoLoopSettings gentle();

/// Ends the loop, however long a busy machine takes. A stop() that came too early leaves the loop
/// running: the next start() does nothing then, and nothing that waits for its ticks comes true.
inline void end(ServoLoop& loop) {
  while (!loop.stop()) {
  }
}

/// Runs ticks [from, to) and returns what each left.
std::vector<ServoOutput> run_ticks(ServoTick& servo, std::uint64_t from, std::uint64_t to);

/// All events that are waiting.
std::vector<ServoEvent> take_events(ServoEventRing& events);
bool has_event(const std::vector<ServoEvent>& events, ServoEventKind kind);

/// Greatest change of force from one tick to the next [N].
double greatest_step(const std::vector<ServoOutput>& outputs);

}  // namespace viscera::test
