// Hands the newest value from one thread to another without locks: neither ever waits for the
// other.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <utility>

#include "kernels/base/fields.h"

namespace viscera {

/// One writer, one reader. The writer fills back() and publishes; the reader gets the newest
/// published value, and keeps it untouched until it asks again. Values in between may be skipped.
/// Nothing is allocated or copied by an exchange.
template <class T>
class TripleBuffer {
 public:
  /// Writer: the value to fill next.
  T& back() { return slots_[back_]; }

  /// Writer: makes back() the newest value; back() is another slot from now on.
  void publish() {
    const std::uint32_t old = middle_.exchange(back_ | kFresh, std::memory_order_acq_rel);
    back_ = old & kSlot;
  }

  /// Reader: takes the newest value if there is one since the last call; true when there was.
  bool update() {
    if (!(middle_.load(std::memory_order_relaxed) & kFresh)) return false;
    const std::uint32_t old = middle_.exchange(front_, std::memory_order_acq_rel);
    front_ = old & kSlot;
    return true;
  }

  /// Reader: the value taken by the last update().
  const T& front() const { return slots_[front_]; }

  /// All slots, stale ones too: a writer may fill a part of back() only.
  struct State {
    std::array<T, 3> slots{};
    std::uint32_t back = 0, middle = 1, front = 2;
    static constexpr auto fields() {
      return std::tuple(field("slots", &State::slots), field("back", &State::back),
                        field("middle", &State::middle), field("front", &State::front));
    }
  };
  /// While neither side is at work.
  State state() const { return {slots_, back_, middle_.load(std::memory_order_acquire), front_}; }
  void restore(State state) {
    slots_ = std::move(state.slots);
    back_ = state.back;
    front_ = state.front;
    middle_.store(state.middle, std::memory_order_release);
  }
  /// Each side has a slot of its own.
  static bool fits(const State& state) {
    const std::uint32_t middle = state.middle & ~kFresh;
    return state.back < 3 && middle < 3 && state.front < 3 && state.back != middle &&
           middle != state.front && state.front != state.back;
  }

 private:
  static constexpr std::uint32_t kSlot = 3, kFresh = 4;

  std::array<T, 3> slots_{};
  std::uint32_t back_ = 0;  // the writer's
  std::atomic<std::uint32_t> middle_{1};
  std::uint32_t front_ = 2;  // the reader's
};

}  // namespace viscera
