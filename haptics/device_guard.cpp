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
  if (!comparable_) return true;
  const double since = static_cast<double>(tick - sampled_at_) * dt_;
  if (state.sample == previous_.sample) {
    fault.kind = ServoEventKind::kDeviceFrozen;
    fault.value = since;
    return since <= limits_.stale_after;
  }
  const double moved = (state.pose.position - previous_.pose.position).norm();
  fault.kind = ServoEventKind::kDeviceJumped;
  fault.value = moved;
  return moved <= settings_.greatest_speed * since + 2.0 * limits_.resolution;
}

void DeviceGuard::fade() {
  if (phase_ == Phase::kEngaged) phase_ = Phase::kFading;
  sound_ticks_ = 0;
}

void DeviceGuard::judge(const DeviceState& state, std::uint64_t tick, ServoEventRing& events) {
  just_engaged_ = false;
  ServoEvent event;
  if (sound(state, tick, event)) {
    state_ = state;
    ++sound_ticks_;
  } else {
    // A device that was never there is waited for, in silence.
    const bool worth_telling = known_ || event.kind != ServoEventKind::kDeviceLost;
    if (worth_telling && (!faulty_ || event.kind != fault_)) {
      events.push(event);
      fault_ = event.kind;
      faulty_ = true;
    }
    fade();
  }
  if (state.connected && finite(state) && (!known_ || state.sample != previous_.sample)) {
    previous_ = state;
    sampled_at_ = tick;
    known_ = comparable_ = true;
  }

  // Who comes back may be elsewhere.
  if (!state.connected) comparable_ = false;

  switch (phase_) {
    case Phase::kFading:
      authority_ = std::max(0.0, authority_ - dt_ / settings_.fade_time);
      if (authority_ == 0.0) phase_ = Phase::kAway;
      break;
    case Phase::kAway:
      if (sound_ticks_ < settle_ticks_ || released_) break;
      phase_ = Phase::kEngaged;
      just_engaged_ = true;
      faulty_ = false;
      events.push({tick, ServoEventKind::kEngaged, 0.0});
      break;
    case Phase::kEngaged:
      authority_ = std::min(1.0, authority_ + dt_ / settings_.engage_time);
      break;
  }
}

void DeviceGuard::fault(ServoEventKind kind, std::uint64_t tick, ServoEventRing& events) {
  if (!faulty_ || kind != fault_) {
    events.push({tick, kind, 0.0});
    fault_ = kind;
    faulty_ = true;
  }
  fade();
}

void DeviceGuard::release(std::uint64_t tick, ServoEventRing& events) {
  if (released_) return;
  released_ = true;
  events.push({tick, ServoEventKind::kReleased, 0.0});
  fade();
}

}  // namespace viscera
