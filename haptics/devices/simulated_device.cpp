#include "haptics/devices/simulated_device.h"

#include <algorithm>
#include <utility>

namespace viscera {
namespace {

constexpr int kSteps = 10;
/// Ticks that a late loop may have slept and the hand still moves through one by one.
constexpr std::uint64_t kMostMissed = 1000;

}  // namespace

DeviceLimits phantom_premium_1_0a() {
  DeviceLimits limits;
  const Vec3 half = 0.5 * Vec3(0.254, 0.178, 0.127);
  limits.work_space = Box(-half, half);
  limits.peak_force = 8.5;
  limits.continuous_force = 1.4;
  limits.resolution = 30e-6;
  limits.apparent_mass = 0.075;
  limits.friction = 0.04;
  limits.stiffness = 3500.0;
  return limits;
}

SimulatedDevice::SimulatedDevice(SimulatedDeviceSettings settings)
    : settings_(std::move(settings)), position_(settings_.path.at(0.0).pose.position) {}

void SimulatedDevice::write(const Vec3& force) noexcept {
  force_ = force;
  // Amplifiers give no more.
  const double size = force_.norm();
  if (size > settings_.limits.peak_force) force_ *= settings_.limits.peak_force / size;
}

/// One tick under the held force.
void SimulatedDevice::advance(double from) {
  const Hand& hand = settings_.hand;
  const DeviceLimits& limits = settings_.limits;
  const double dt = settings_.dt / kSteps;
  const double inertia = limits.apparent_mass + hand.mass;
  const double implicit = inertia + dt * (hand.damping + dt * hand.stiffness);
  for (int step = 0; step < kSteps; ++step) {
    const HandPath::At wanted = settings_.path.at(from + (step + 1) * dt);
    const Vec3 pull = hand.stiffness * (wanted.pose.position - position_) +
                      hand.damping * wanted.velocity + force_;
    velocity_ = (inertia * velocity_ + dt * pull) / implicit;
    const double speed = velocity_.norm(), lost = dt * limits.friction / implicit;
    velocity_ = speed > lost ? Vec3(velocity_ * (1.0 - lost / speed)) : Vec3::Zero();
    position_ += dt * velocity_;
    for (int axis = 0; axis < 3; ++axis) {
      const double inside =
          std::clamp(position_[axis], limits.work_space.min()[axis], limits.work_space.max()[axis]);
      if (inside == position_[axis]) continue;
      position_[axis] = inside;
      velocity_[axis] = 0.0;
    }
  }
}

DeviceState SimulatedDevice::read(std::uint64_t tick) noexcept {
  if (!started_ || tick > tick_ + kMostMissed) tick_ = tick;
  started_ = true;
  for (; tick_ < tick; ++tick_) advance(static_cast<double>(tick_) * settings_.dt);
  const HandPath::At wanted = settings_.path.at(static_cast<double>(tick) * settings_.dt);
  DeviceState state;
  const double step = settings_.limits.resolution;
  state.pose.position = (position_ / step).array().round() * step;
  state.pose.orientation = wanted.pose.orientation;
  state.buttons = wanted.buttons;
  state.sample = tick + 1;
  return state;
}

}  // namespace viscera
