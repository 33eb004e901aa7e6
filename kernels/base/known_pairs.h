// Answers about pairs of things that don't change, kept once they were found.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

namespace viscera {

/// Two bits a pair, whichever of both is named first. It answers the same whatever was asked
/// before, and by many threads at once.
class KnownPairs {
 public:
  KnownPairs() = default;
  /// Of more things than kMost nothing is kept.
  explicit KnownPairs(std::size_t things) {
    if (things > 0 && things <= kMost)
      known_ = std::vector<std::atomic<std::uint8_t>>((things * (things - 1) / 2 + 3) / 4);
  }

  /// find(higher, lower) of two different things, which always gives the same.
  template <class Find>
  bool ask(std::size_t a, std::size_t b, const Find& find) const {
    if (a < b) std::swap(a, b);
    if (known_.empty()) return find(a, b);
    const std::size_t pair = a * (a - 1) / 2 + b, shift = 2 * (pair % 4);
    std::atomic<std::uint8_t>& four = known_[pair / 4];
    const unsigned known = four.load(std::memory_order_relaxed) >> shift & 3u;
    if (known != 0) return known == 3u;
    const bool found = find(a, b);
    four.fetch_or(static_cast<std::uint8_t>((found ? 3u : 1u) << shift), std::memory_order_relaxed);
    return found;
  }

  std::size_t memory_bytes() const { return known_.size(); }

 private:
  static constexpr std::size_t kMost = 20000;  // 50 MB

  mutable std::vector<std::atomic<std::uint8_t>> known_;  // empty: too many, or none
};

}  // namespace viscera
