#include "haptics/z_width.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "haptics/virtual_wall.h"

namespace viscera {
namespace {

constexpr double kRigid = 1e7;                         // [N/m]
constexpr double kFeltRattle = 1e-3;                   // [m/s]
constexpr double kForce = 1.0;                         // [N], which motors bear for any time
constexpr double kDeepest = 0.03;                      // [m]
constexpr std::uint64_t kSettled = 2000, kEnd = 3000;  // ticks
constexpr double kFirst = 10.0, kStep = 1.1;           // of the grid of stiffness

}  // namespace

ZWidthTrial press_wall(const ZWidthCase& trial) {
  SimulatedDeviceSettings device_settings;
  device_settings.limits = trial.device;
  device_settings.hand = Hand::with_grip(trial.grip);
  const double depth =
      std::min(kDeepest, kForce * (1.0 / device_settings.hand.stiffness + 1.0 / trial.stiffness));
  for (const auto& [time, z] : {std::pair{0.3, 0.01}, std::pair{0.8, -depth}}) {
    HandPath::Key key;
    key.time = time;
    key.pose.position.z() = z;
    device_settings.path.keys.push_back(key);
  }
  SimulatedDevice device(device_settings);
  VirtualWall wall;
  wall.stiffness = kRigid;
  ServoSettings settings;
  settings.coupling = {trial.stiffness, trial.damping};
  settings.passivity.control = trial.passivity;
  ServoTick servo(device, wall, settings);

  ZWidthTrial out;
  double square = 0.0;
  for (std::uint64_t tick = 0; tick < kEnd; ++tick) {
    const double force = servo.run(tick).force.z();
    if (tick < kSettled) continue;
    square += device.velocity().squaredNorm();
    out.force += force / static_cast<double>(kEnd - kSettled);
  }
  out.rattle = std::sqrt(square / static_cast<double>(kEnd - kSettled));
  out.given = servo.energy_given();
  out.stable = out.rattle < kFeltRattle;
  return out;
}

double greatest_stable_stiffness(ZWidthCase trial, double most) {
  double greatest = 0.0;
  for (trial.stiffness = kFirst; trial.stiffness <= most; trial.stiffness *= kStep) {
    if (!press_wall(trial).stable) break;
    greatest = trial.stiffness;
  }
  return greatest;
}

}  // namespace viscera
