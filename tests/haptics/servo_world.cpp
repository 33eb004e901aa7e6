#include "tests/haptics/servo_world.h"

#include <algorithm>

namespace viscera::test {

HandPath path_along_z(const std::vector<std::pair<double, double>>& keys) {
  HandPath path;
  for (const auto& [time, z] : keys) {
    HandPath::Key key;
    key.time = time;
    key.pose.position = Vec3(0.0, 0.0, z);
    path.keys.push_back(key);
  }
  return path;
}

SimulatedDeviceSettings pressing(double from, double until) {
  SimulatedDeviceSettings settings;
  settings.path = path_along_z({{from, 0.01}, {until, -0.01}});
  return settings;
}

VirtualWall wall_at_zero(double stiffness, double damping) {
  VirtualWall wall;
  wall.stiffness = stiffness;
  wall.damping = damping;
  return wall;
}

ServoSettings patient() {
  ServoSettings settings;
  settings.guard.tick_timeout = 60.0;
  return settings;
}

ServoLoopSettings gentle() {
  ServoLoopSettings settings;
  settings.priority = 0;
  settings.lock_memory = false;
  return settings;
}

std::vector<ServoOutput> run_ticks(ServoTick& servo, std::uint64_t from, std::uint64_t to) {
  std::vector<ServoOutput> outputs;
  outputs.reserve(to - from);
  for (std::uint64_t tick = from; tick < to; ++tick) outputs.push_back(servo.run(tick));
  return outputs;
}

std::vector<ServoEvent> take_events(ServoEventRing& events) {
  std::vector<ServoEvent> all;
  for (ServoEvent event; events.pop(event);) all.push_back(event);
  return all;
}

bool has_event(const std::vector<ServoEvent>& events, ServoEventKind kind) {
  return std::any_of(events.begin(), events.end(),
                     [&](const ServoEvent& event) { return event.kind == kind; });
}

double greatest_step(const std::vector<ServoOutput>& outputs) {
  double greatest = 0.0;
  for (std::size_t i = 1; i < outputs.size(); ++i)
    greatest = std::max(greatest, (outputs[i].force - outputs[i - 1].force).norm());
  return greatest;
}

}  // namespace viscera::test
