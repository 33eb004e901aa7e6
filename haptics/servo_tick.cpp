#include "haptics/servo_tick.h"

#include <algorithm>
#include <chrono>
#include <cmath>

namespace viscera {

/// Gives the time since the last part to the part that ends. Where nobody asks, no clock is read.
class TickClock {
 public:
  explicit TickClock(TickTimes* times) : times_(times) {
    if (!times_) return;
    times_->fill(0);
    last_ = std::chrono::steady_clock::now();
  }
  void end(TickPart part) {
    if (!times_) return;
    const auto now = std::chrono::steady_clock::now();
    (*times_)[static_cast<std::size_t>(part)] += static_cast<std::uint64_t>(
        std::chrono::duration_cast<std::chrono::nanoseconds>(now - last_).count());
    last_ = now;
  }

 private:
  TickTimes* times_;
  std::chrono::steady_clock::time_point last_;
};

namespace {

bool finite(const TactileForce& felt) {
  return felt.force.allFinite() && felt.stiffness.allFinite() && std::isfinite(felt.energy) &&
         std::isfinite(felt.supplied);
}

}  // namespace

ServoTick::ServoTick(HapticDevice& device, TactileModel& tissue, const ServoSettings& settings)
    : device_(device),
      pen_(device),
      tissue_(tissue),
      settings_(settings),
      guard_(settings.guard, device.limits(), settings.dt),
      coupling_(settings.coupling),
      passivity_(settings.passivity, device.limits(), settings.dt),
      limits_(settings.force, device.limits(), settings.dt) {}

/// The coupling's force for a sound reading, and what the tissue said; of `now` the ticks are set.
ServoTick::Felt ServoTick::feel(const DeviceState& state, const ToolMotion& now, double dt,
                                TickClock& clock) noexcept {
  const Vec3 device = settings_.placement.to_world(state.pose.position);
  const auto spoilt = [&](ServoEventKind kind) {
    guard_.fault(kind, now.tick, events_);
    coupling_.reset(output_.device.position);
    return Felt();
  };
  if (!device.allFinite()) return spoilt(ServoEventKind::kForceNotFinite);
  if (guard_.just_engaged()) {
    coupling_.reset(device);
    passivity_.reset(device);
    tool_before_ = device;
  }
  ToolMotion motion = now;
  motion.pose.position = coupling_.predict(device, dt);
  motion.pose.orientation = settings_.placement.orientation * state.pose.orientation;
  motion.velocity = (motion.pose.position - tool_before_) / dt;
  motion.buttons = state.buttons;
  clock.end(TickPart::kCoupling);
  // Tissue that walks over its surface to such a place might never come back.
  if (!motion.pose.position.allFinite()) return spoilt(ServoEventKind::kForceNotFinite);

  Felt felt;
  felt.tissue = tissue_.respond(motion, dt);
  clock.end(TickPart::kTissue);
  if (!finite(felt.tissue)) return spoilt(ServoEventKind::kTissueNotFinite);
  felt.force = coupling_.settle(device, motion.pose.position, felt.tissue, dt);
  if (!felt.force.allFinite() || !std::isfinite(coupling_.energy()))
    return spoilt(ServoEventKind::kForceNotFinite);
  tool_before_ = coupling_.tool();
  output_.device = {device, motion.pose.orientation};
  output_.tool = {coupling_.tool(), motion.pose.orientation};
  output_.buttons = state.buttons;
  clock.end(TickPart::kCoupling);
  return felt;
}

/// What a fading force still has to be damped by [N].
Vec3 ServoTick::watch_fading(double dt) noexcept {
  if (guard_.phase() == DeviceGuard::Phase::kAway && output_.force.isZero(0.0)) return Vec3::Zero();
  const Vec3 device = settings_.placement.to_world(guard_.reading().pose.position);
  if (!guard_.sound() || !device.allFinite()) {
    passivity_.lose_sight();
    return Vec3::Zero();
  }
  const Vec3 damper = passivity_.fade(output_.force, device, dt);
  return guard_.phase() == DeviceGuard::Phase::kFading ? damper : Vec3::Zero();
}

void ServoTick::forget_force() noexcept {
  coupling_.reset(output_.device.position);
  passivity_.reset(output_.device.position);
  limits_.reset();
  tool_before_ = output_.device.position;
  fading_ = Vec3::Zero();
  output_.force = Vec3::Zero();
}

const ServoOutput& ServoTick::run(std::uint64_t tick, TickTimes* times) noexcept {
  TickClock clock(times);
  ToolMotion now;
  now.tick = tick;
  now.ticks = tick > output_.tick ? tick - output_.tick : 1;
  const double dt = settings_.dt * static_cast<double>(now.ticks);
  if (dt > settings_.guard.tick_timeout && guard_.phase() != DeviceGuard::Phase::kAway)
    guard_.fault(ServoEventKind::kTicksMissing, tick, events_, dt);
  guard_.judge(device_.read(tick), tick, dt, events_);
  output_.tick = tick;
  clock.end(TickPart::kRead);

  Felt felt;
  if (guard_.phase() == DeviceGuard::Phase::kEngaged) felt = feel(guard_.reading(), now, dt, clock);

  const double authority = guard_.authority();
  Vec3 force = Vec3::Zero();
  if (guard_.phase() == DeviceGuard::Phase::kEngaged) {
    const bool full = authority == 1.0 && !limits_.limited();
    const double stored = felt.tissue.energy < 0.0 ? -1.0 : felt.tissue.energy + coupling_.energy();
    force = authority * felt.force;
    force += passivity_.update(output_.force,
                               {output_.device.position, stored, felt.tissue.supplied, dt, full});
    const Vec3 wanted = force;
    force = limits_.apply(wanted, now.ticks);
    const double size2 = wanted.squaredNorm();
    const double kept = limits_.limited() && size2 > 0.0 ? force.dot(wanted) / size2 : 1.0;
    passivity_.show(authority * std::clamp(kept, 0.0, 1.0));
    fading_ = authority > 0.0 ? Vec3(force / authority) : Vec3::Zero();
  } else {
    // Nothing that a broken reading says counts: the last force, dying away.
    force = limits_.apply(authority * fading_ + watch_fading(dt), now.ticks);
  }
  Vec3 shown = settings_.placement.direction_to_local(force);
  if (const auto verdict = limits_.judge(shown); verdict != ForceLimits::Verdict::kSound) {
    const bool large = verdict == ForceLimits::Verdict::kTooLarge;
    guard_.fault(large ? ServoEventKind::kForceTooLarge : ServoEventKind::kForceNotFinite, tick,
                 events_, large ? shown.norm() : 0.0);
    forget_force();
    force = shown = Vec3::Zero();
  }
  clock.end(TickPart::kLimits);

  if (!pen_.write(shown)) {
    guard_.fault(ServoEventKind::kTicksMissing, tick, events_, settings_.guard.tick_timeout);
    forget_force();
    force = Vec3::Zero();
  }
  output_.force = force;
  greatest_force_ = std::max(greatest_force_, force.norm());
  output_.tissue = felt.tissue.force;
  output_.touching = felt.tissue.touching;
  output_.authority = guard_.authority();
  output_.damping = guard_.phase() == DeviceGuard::Phase::kAway ? 0.0 : passivity_.damping();
  clock.end(TickPart::kWrite);
  return output_;
}

ServoTick::State ServoTick::state() const {
  return {guard_.state(), coupling_.state(), passivity_.state(), limits_.state(), events_.state(),
          output_,        greatest_force_,   tool_before_,       fading_};
}

void ServoTick::restore(const State& state) {
  guard_.restore(state.guard);
  coupling_.restore(state.coupling);
  passivity_.restore(state.passivity);
  limits_.restore(state.limits);
  events_.restore(state.events);
  output_ = state.output;
  greatest_force_ = state.greatest_force;
  tool_before_ = state.tool_before;
  fading_ = state.fading;
}

bool ServoTick::fits(const State& state) {
  return DeviceGuard::fits(state.guard) && ServoEventRing::fits(state.events);
}

}  // namespace viscera
