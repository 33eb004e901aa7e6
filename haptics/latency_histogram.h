// Percentiles of times without keeping the times: fixed memory, one writer, readers at any moment.
#pragma once

#include <array>
#include <atomic>
#include <bit>
#include <cstdint>

namespace viscera {

/// Buckets that grow with the value: 32 to an octave above 32 ns, so that a percentile is at most
/// 1/32 too high; below it every nanosecond has its own. add() is a handful of instructions.
class LatencyHistogram {
 public:
  static constexpr int kSub = 32;      ///< buckets an octave
  static constexpr int kOctaves = 36;  ///< up to about 37 minutes
  static constexpr int kBuckets = kSub * kOctaves;

  void add(std::uint64_t ns) noexcept {
    bump(counts_[bucket(ns)]);
    bump(count_);
    if (ns > max_.load(std::memory_order_relaxed)) max_.store(ns, std::memory_order_relaxed);
  }

  std::uint64_t count() const noexcept { return count_.load(std::memory_order_relaxed); }
  std::uint64_t max_ns() const noexcept { return max_.load(std::memory_order_relaxed); }
  std::uint64_t in_bucket(int i) const noexcept {
    return counts_[static_cast<std::size_t>(i)].load(std::memory_order_relaxed);
  }

  /// The smallest bucket's end below which at least this share of the values lies [ns]; never more
  /// than the greatest value. Zero without values.
  std::uint64_t percentile_ns(double share) const noexcept {
    std::uint64_t all = 0;
    for (int i = 0; i < kBuckets; ++i) all += in_bucket(i);
    if (all == 0) return 0;
    std::uint64_t sum = 0;
    for (int i = 0; i < kBuckets; ++i) {
      sum += in_bucket(i);
      if (static_cast<double>(sum) >= share * static_cast<double>(all))
        return end_ns(i) < max_ns() ? end_ns(i) : max_ns();
    }
    return max_ns();
  }

  static std::size_t bucket(std::uint64_t ns) noexcept {
    if (ns < kSub) return ns;
    // With b bits, the first falls away and the next five say which of 32.
    const int octave = std::bit_width(ns) - 5;
    const std::size_t index =
        static_cast<std::size_t>(octave) * kSub + ((ns >> (octave - 1)) - kSub);
    return index < kBuckets ? index : kBuckets - 1;
  }
  /// The greatest value of a bucket [ns].
  static std::uint64_t end_ns(int i) noexcept {
    if (i < kSub) return static_cast<std::uint64_t>(i);
    const int octave = i / kSub;
    const auto first = static_cast<std::uint64_t>(i % kSub + kSub);
    return ((first + 1) << (octave - 1)) - 1;
  }

 private:
  // One writer: no read-modify-write needed.
  static void bump(std::atomic<std::uint64_t>& value) noexcept {
    value.store(value.load(std::memory_order_relaxed) + 1, std::memory_order_relaxed);
  }

  std::array<std::atomic<std::uint64_t>, kBuckets> counts_{};
  std::atomic<std::uint64_t> count_{0}, max_{0};
};

}  // namespace viscera
