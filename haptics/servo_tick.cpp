#include "haptics/servo_tick.h"

#include <algorithm>
#include <chrono>

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

ServoTick::ServoTick(HapticDevice& device, TactileModel& tissue, const ServoSettings& settings)
    : device_(device),
      tissue_(tissue),
      settings_(settings),
      guard_(settings.guard, device.limits(), settings.dt),
      coupling_(settings.coupling, settings.dt),
      passivity_(settings.passivity, device.limits(), settings.dt),
      limits_(settings.force, device.limits(), settings.dt) {}

/// The coupling's force for a sound reading, and what the tissue said.
ServoTick::Felt ServoTick::feel(const DeviceState& state, std::uint64_t tick,
                                TickClock& clock) noexcept {
  const Vec3 device = settings_.placement.to_world(state.pose.position);
  if (guard_.just_engaged()) {
    coupling_.reset(device);
    passivity_.reset(device);
    tool_before_ = device;
  }
  ToolMotion motion;
  motion.pose.position = coupling_.predict(device);
  motion.pose.orientation = settings_.placement.orientation * state.pose.orientation;
  motion.velocity = (motion.pose.position - tool_before_) / settings_.dt;
  motion.buttons = state.buttons;
  motion.tick = tick;
  clock.end(TickPart::kCoupling);

  Felt felt;
  felt.tissue = tissue_.respond(motion, settings_.dt);
  clock.end(TickPart::kTissue);
  if (!felt.tissue.force.allFinite() || !felt.tissue.stiffness.allFinite()) {
    guard_.fault(ServoEventKind::kTissueNotFinite, tick, events_);
    felt.tissue = {};
    return felt;
  }
  felt.force = coupling_.settle(device, motion.pose.position, felt.tissue);
  tool_before_ = coupling_.tool();
  output_.device = {device, motion.pose.orientation};
  output_.tool = {coupling_.tool(), motion.pose.orientation};
  output_.buttons = state.buttons;
  clock.end(TickPart::kCoupling);
  return felt;
}

const ServoOutput& ServoTick::run(std::uint64_t tick, TickTimes* times) noexcept {
  TickClock clock(times);
  guard_.judge(device_.read(tick), tick, events_);
  output_.tick = tick;
  clock.end(TickPart::kRead);

  const DeviceGuard::Phase phase = guard_.phase();
  const bool engaged = phase == DeviceGuard::Phase::kEngaged;
  Felt felt;
  if (engaged) felt = feel(guard_.reading(), tick, clock);

  Vec3 force = Vec3::Zero();
  if (guard_.phase() == DeviceGuard::Phase::kEngaged) {
    const bool full = guard_.authority() == 1.0 && !limits_.limited();
    const double stored = felt.tissue.energy < 0.0 ? -1.0 : felt.tissue.energy + coupling_.energy();
    force = guard_.authority() * felt.force;
    force += passivity_.update(output_.force,
                               {output_.device.position, stored, felt.tissue.supplied, full});
    fading_ = guard_.authority() > 0.0 ? Vec3(force / guard_.authority()) : Vec3::Zero();
  } else {
    // Nothing that a broken reading says counts: the last force, dying away.
    force = guard_.authority() * fading_;
  }
  force = limits_.apply(force);
  output_.force = force;
  greatest_force_ = std::max(greatest_force_, force.norm());
  output_.tissue = felt.tissue.force;
  output_.touching = felt.tissue.touching;
  output_.authority = guard_.authority();
  output_.damping = engaged ? passivity_.damping() : 0.0;
  clock.end(TickPart::kLimits);

  device_.write(settings_.placement.direction_to_local(force));
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
