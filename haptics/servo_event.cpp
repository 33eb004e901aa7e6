#include "haptics/servo_event.h"

#include <fmt/format.h>

#include <algorithm>

namespace viscera {
namespace {

std::string what(const ServoEvent& event) {
  const double value = event.value;
  switch (event.kind) {
    case ServoEventKind::kEngaged:
      return "the device's readings are sound; its force rises to the tissue's";
    case ServoEventKind::kDeviceLost:
      return "the device is gone; force goes to zero until it is back";
    case ServoEventKind::kDeviceFrozen:
      return fmt::format("no new reading from the device for {:.0f} ms; force goes to zero",
                         1e3 * value);
    case ServoEventKind::kDeviceJumped:
      return fmt::format("the device jumped by {:.1f} mm, which no hand does; force goes to zero",
                         1e3 * value);
    case ServoEventKind::kDeviceNotFinite:
      return "the device's reading isn't a finite pose; force goes to zero";
    case ServoEventKind::kDeviceOutside:
      return fmt::format(
          "the device reads {:.1f} mm outside its own work space; force goes to zero", 1e3 * value);
    case ServoEventKind::kTissueNotFinite:
      return "the tissue's force isn't finite; force goes to zero";
    case ServoEventKind::kReleased:
      return "the loop ends; force goes to zero";
    case ServoEventKind::kClientConnected:
      return "a client has connected";
    case ServoEventKind::kClientLeft:
      return fmt::format("the client has left after {:.0f} messages", value);
    case ServoEventKind::kMessageTooLong:
      return fmt::format("a message announces {:.0f} bytes; the client is cut off", value);
    case ServoEventKind::kMessageMalformed:
      return fmt::format(
          "what the client sent isn't OpenIGTLink, or a message of {:.0f} bytes has "
          "the wrong size for its type; the client is cut off",
          value);
    case ServoEventKind::kMessageBadCrc:
      return fmt::format("a message's checksum is wrong (number {:.0f}); it is left out", value);
    case ServoEventKind::kMessageNotAPose:
      return "a TRANSFORM isn't a finite rigid motion; it is left out";
    case ServoEventKind::kMessageStalled:
      return fmt::format("a message stopped with {:.0f} bytes to come; the client is cut off",
                         value);
    case ServoEventKind::kFlood:
      return fmt::format("the client floods with {:.0f} messages a second; it is cut off", value);
    case ServoEventKind::kForceNotFinite:
      return "the force on the hand isn't finite; force goes to zero";
    case ServoEventKind::kForceTooLarge:
      return fmt::format("a force of {:.1f} N is more than the device bears; zero is shown instead",
                         value);
    case ServoEventKind::kTicksMissing:
      return fmt::format("no tick for {:.0f} ms; force goes to zero", 1e3 * value);
    case ServoEventKind::kWatchdog:
      return fmt::format("no tick has ended for {:.0f} ms; the watchdog takes the force to zero",
                         1e3 * value);
    case ServoEventKind::kAlwaysLate:
      return fmt::format(
          "ticks have left no time to other threads for {:.0f} ms; the loop rests after each now, "
          "and misses ticks",
          1e3 * value);
    case ServoEventKind::kTickStuck:
      return "the loop should end, but a tick doesn't; its device is held at zero force";
  }
  return "an event without a name";
}

}  // namespace

std::string describe(const ServoEvent& event) {
  if (event.tick == 0) return what(event);
  return fmt::format("tick {}: {}", event.tick, what(event));
}

ServoEventRing::State ServoEventRing::state() const {
  State state;
  const std::uint32_t head = head_.load(std::memory_order_acquire);
  for (std::uint32_t i = tail_.load(std::memory_order_acquire); i != head; ++i)
    state.waiting.push_back(slots_[i % kSlots]);
  state.dropped = dropped();
  return state;
}

void ServoEventRing::restore(const State& state) noexcept {
  std::copy(state.waiting.begin(), state.waiting.end(), slots_.begin());
  tail_.store(0, std::memory_order_relaxed);
  head_.store(static_cast<std::uint32_t>(state.waiting.size()), std::memory_order_release);
  dropped_.store(state.dropped, std::memory_order_relaxed);
}

bool ServoEventRing::fits(const State& state) {
  return state.waiting.size() <= kSlots &&
         std::all_of(state.waiting.begin(), state.waiting.end(),
                     [](const ServoEvent& event) { return is_kind(event.kind); });
}

}  // namespace viscera
