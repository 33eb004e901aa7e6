// What the 1 kHz side has to report, handed over without locks or allocation.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <string>
#include <vector>

#include "kernels/base/fields.h"

namespace viscera {

enum class ServoEventKind : std::uint8_t {
  kEngaged,           ///< readings are sound; force rises to what the tissue says
  kDeviceLost,        ///< unplugged, or the connection ended
  kDeviceFrozen,      ///< no new reading; value: [s] since the last
  kDeviceJumped,      ///< farther than a hand moves; value: [m]
  kDeviceNotFinite,   ///< NaN, infinity or no rotation in the reading
  kDeviceOutside,     ///< outside its own work space; value: [m] beyond
  kTissueNotFinite,   ///< the tissue answered with NaN or infinity
  kReleased,          ///< asked to let go
  kClientConnected,   ///< a network client came
  kClientLeft,        ///< and went; value: messages that it sent
  kMessageTooLong,    ///< a header that announces too much; value: bytes
  kMessageMalformed,  ///< not the protocol, or the wrong size for its type; value: bytes
  kMessageBadCrc,     ///< value: how many since the client came
  kMessageNotAPose,   ///< a TRANSFORM with NaN, or that isn't a rigid motion
  kMessageStalled,    ///< a message that wasn't finished in time; value: bytes missing
  kFlood,             ///< more messages than any device sends; value: [1/s]
  kForceNotFinite,    ///< what tissue and device made a force of isn't one
  kForceTooLarge,     ///< above what the device bears, after all limits; value: [N]
  kTicksMissing,      ///< too long between two ticks, or the watchdog came; value: [s]
  kWatchdog,          ///< no tick has ended; value: [s] since the last. From the watchdog's thread
  kAlwaysLate,        ///< ticks leave no time to others; value: [s] without a rest
  kTickStuck,         ///< asked to stop, a tick doesn't end. From the watchdog's thread
};

struct ServoEvent {
  std::uint64_t tick = 0;  ///< of the loop; 0 from other threads
  ServoEventKind kind = ServoEventKind::kEngaged;
  double value = 0.0;

  static constexpr auto fields() {
    return std::tuple(field("tick", &ServoEvent::tick), field("kind", &ServoEvent::kind),
                      field("value", &ServoEvent::value));
  }
};
static_assert(fields_cover<ServoEvent>());

constexpr bool is_kind(ServoEventKind kind) {
  return kind <= ServoEventKind::kTickStuck;
}

/// One sentence for the log: what happened and what was done about it.
std::string describe(const ServoEvent& event);

/// The last events, from one writing thread to one reading thread. When the reader is too slow,
/// new events are counted and dropped: the writer never waits.
class ServoEventRing {
 public:
  static constexpr std::uint32_t kSlots = 256;

  void push(const ServoEvent& event) noexcept {
    const std::uint32_t head = head_.load(std::memory_order_relaxed);
    if (head - tail_.load(std::memory_order_acquire) == kSlots) {
      dropped_.fetch_add(1, std::memory_order_relaxed);
      return;
    }
    slots_[head % kSlots] = event;
    head_.store(head + 1, std::memory_order_release);
  }

  bool pop(ServoEvent& event) noexcept {
    const std::uint32_t tail = tail_.load(std::memory_order_relaxed);
    if (tail == head_.load(std::memory_order_acquire)) return false;
    event = slots_[tail % kSlots];
    tail_.store(tail + 1, std::memory_order_release);
    return true;
  }

  std::uint64_t dropped() const noexcept { return dropped_.load(std::memory_order_relaxed); }

  struct State {
    std::vector<ServoEvent> waiting;  ///< that nobody has read
    std::uint64_t dropped = 0;
    static constexpr auto fields() {
      return std::tuple(field("waiting", &State::waiting), field("dropped", &State::dropped));
    }
  };
  /// While neither side is at work.
  State state() const;
  void restore(const State& state) noexcept;
  static bool fits(const State& state);

 private:
  std::array<ServoEvent, kSlots> slots_{};
  std::atomic<std::uint32_t> head_{0}, tail_{0};
  std::atomic<std::uint64_t> dropped_{0};
};
static_assert(fields_cover<ServoEventRing::State>());

}  // namespace viscera
