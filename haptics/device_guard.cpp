#include "haptics/device_guard.h"

#include <algorithm>
#include <cmath>

namespace viscera {
namespace {

bool finite(const DeviceState& state) {
  // A quaternion off by more is no rotation, whatever it was meant to be.
  constexpr double kUnit = 1e-3;
  return state.pose.position.allFinite() && state.pose.orientation.coeffs().allFinite() &&
         std::abs(state.pose.orientation.norm() - 1.0) < kUnit;
}

}  // namespace

DeviceGuard::DeviceGuard(const GuardSettings& settings, const DeviceLimits& limits, double dt)
    : settings_(settings),
      limits_(limits),
      dt_(dt),
      settle_ticks_(static_cast<std::uint64_t>(std::ceil(settings.settle_time / dt))) {}

bool DeviceGuard::sound(const DeviceState& state, std::uint64_t tick, ServoEvent& fault) const {
  fault.tick = tick;
  if (!state.connected) {
    fault.kind = ServoEventKind::kDeviceLost;
    return false;
  }
  if (!finite(state)) {
    fault.kind = ServoEventKind::kDeviceNotFinite;
    return false;
  }
  const double outside = limits_.work_space.exteriorDistance(state.pose.position);
  if (outside > settings_.outside_margin) {
    fault.kind = ServoEventKind::kDeviceOutside;
    fault.value = outside;
    return false;
  }
  if (!state_.comparable) return true;
  const double since = static_cast<double>(tick - state_.sampled_at) * dt_;
  if (state.sample == state_.previous.sample) {
    fault.kind = ServoEventKind::kDeviceFrozen;
    fault.value = since;
    return since <= limits_.stale_after;
  }
  const double moved = (state.pose.position - state_.previous.pose.position).norm();
  fault.kind = ServoEventKind::kDeviceJumped;
  fault.value = moved;
  return moved <= settings_.greatest_speed * since + 2.0 * limits_.resolution;
}

void DeviceGuard::fade() {
  if (state_.phase == Phase::kEngaged) state_.phase = Phase::kFading;
  state_.sound_ticks = 0;
}

void DeviceGuard::judge(const DeviceState& state, std::uint64_t tick, double elapsed,
                        ServoEventRing& events) {
  state_.just_engaged = false;
  ServoEvent event;
  sound_ = sound(state, tick, event);
  if (sound_) {
    state_.reading = state;
    ++state_.sound_ticks;
  } else {
    // A device that was never there is waited for, in silence.
    const bool worth_telling = state_.known || event.kind != ServoEventKind::kDeviceLost;
    if (worth_telling && (!state_.faulty || event.kind != state_.fault)) {
      events.push(event);
      state_.fault = event.kind;
      state_.faulty = true;
    }
    fade();
  }
  if (state.connected && finite(state) &&
      (!state_.known || state.sample != state_.previous.sample)) {
    state_.previous = state;
    state_.sampled_at = tick;
    state_.known = state_.comparable = true;
  }

  // Who comes back may be elsewhere.
  if (!state.connected) state_.comparable = false;

  switch (state_.phase) {
    case Phase::kFading:
      state_.authority = std::max(0.0, state_.authority - elapsed / settings_.fade_time);
      if (state_.authority == 0.0) state_.phase = Phase::kAway;
      break;
    case Phase::kAway:
      if (state_.sound_ticks < settle_ticks_ || state_.released) break;
      state_.phase = Phase::kEngaged;
      state_.just_engaged = true;
      state_.faulty = false;
      events.push({tick, ServoEventKind::kEngaged, 0.0});
      break;
    case Phase::kEngaged:
      state_.authority = std::min(1.0, state_.authority + dt_ / settings_.engage_time);
      break;
  }
}

void DeviceGuard::fault(ServoEventKind kind, std::uint64_t tick, ServoEventRing& events,
                        double value) {
  if (!state_.faulty || kind != state_.fault) {
    events.push({tick, kind, value});
    state_.fault = kind;
    state_.faulty = true;
  }
  fade();
}

void DeviceGuard::release(std::uint64_t tick, ServoEventRing& events) {
  if (state_.released) return;
  state_.released = true;
  events.push({tick, ServoEventKind::kReleased, 0.0});
  fade();
}

}  // namespace viscera
