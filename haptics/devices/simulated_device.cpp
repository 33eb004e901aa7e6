#include "haptics/devices/simulated_device.h"

#include <algorithm>
#include <utility>

#include "haptics/devices/state_bytes.h"

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
    : settings_(std::move(settings)) {
  state_.position = settings_.path.at(0.0).pose.position;
}

void SimulatedDevice::write(const Vec3& force) noexcept {
  // Amplifiers give no more.
  const double size = force.norm(), peak = settings_.limits.peak_force;
  hold(size > peak ? Vec3(force * (peak / size)) : force);
}

void SimulatedDevice::hold(const Vec3& given) {
  for (int axis = 0; axis < 3; ++axis)
    written_[static_cast<std::size_t>(axis)].store(given[axis], std::memory_order_relaxed);
}

Vec3 SimulatedDevice::written() const {
  return {written_[0].load(std::memory_order_relaxed), written_[1].load(std::memory_order_relaxed),
          written_[2].load(std::memory_order_relaxed)};
}

SimulatedDevice::State SimulatedDevice::state() const {
  State state = state_;
  state.force = written();
  return state;
}

void SimulatedDevice::restore(const State& state) {
  state_ = state;
  hold(state.force);
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
    const Vec3 pull = hand.stiffness * (wanted.pose.position - state_.position) +
                      hand.damping * wanted.velocity + state_.force;
    state_.velocity = (inertia * state_.velocity + dt * pull) / implicit;
    const double speed = state_.velocity.norm(), lost = dt * limits.friction / implicit;
    state_.velocity = speed > lost ? Vec3(state_.velocity * (1.0 - lost / speed)) : Vec3::Zero();
    state_.position += dt * state_.velocity;
    for (int axis = 0; axis < 3; ++axis) {
      const double inside = std::clamp(state_.position[axis], limits.work_space.min()[axis],
                                       limits.work_space.max()[axis]);
      if (inside == state_.position[axis]) continue;
      state_.position[axis] = inside;
      state_.velocity[axis] = 0.0;
    }
  }
}

DeviceState SimulatedDevice::read(std::uint64_t tick) noexcept {
  state_.force = written();
  if (!state_.started || tick > state_.tick + kMostMissed) state_.tick = tick;
  state_.started = true;
  for (; state_.tick < tick; ++state_.tick)
    advance(static_cast<double>(state_.tick) * settings_.dt);
  const HandPath::At wanted = settings_.path.at(static_cast<double>(tick) * settings_.dt);
  DeviceState state;
  const double step = settings_.limits.resolution;
  state.pose.position = (state_.position / step).array().round() * step;
  state.pose.orientation = wanted.pose.orientation;
  state.buttons = wanted.buttons;
  state.sample = tick + 1;
  return state;
}

bool SimulatedDevice::fits(const State& state) const {
  return state.position.allFinite() && state.velocity.allFinite() && state.force.allFinite();
}

std::vector<std::byte> SimulatedDevice::state_bytes() const {
  return saved(*this);
}
bool SimulatedDevice::fits_bytes(std::span<const std::byte> bytes) const {
  return state_in(bytes, *this).has_value();
}
void SimulatedDevice::restore_bytes(std::span<const std::byte> bytes) {
  if (auto state = state_in(bytes, *this)) restore(std::move(*state));
}

}  // namespace viscera
