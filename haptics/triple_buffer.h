// Hands the newest value from one thread to another without locks: neither ever waits for the
// other.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>

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

 private:
  static constexpr std::uint32_t kSlot = 3, kFresh = 4;

  std::array<T, 3> slots_{};
  std::uint32_t back_ = 0;  // the writer's
  std::atomic<std::uint32_t> middle_{1};
  std::uint32_t front_ = 2;  // the reader's
};

}  // namespace viscera
