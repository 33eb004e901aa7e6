// Counter-based random numbers: the value depends on (seed, stream, counter) alone, so that results
// don't depend on threads or on the order of calls.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>

#include "kernels/base/types.h"

namespace viscera {

/// SplitMix64's finaliser [Steele2014]: a bijection of 64-bit words with full avalanche.
constexpr std::uint64_t mix64(std::uint64_t x) {
  x += 0x9e3779b97f4a7c15ull;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9ull;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebull;
  return x ^ (x >> 31);
}

/// One random stream, named by a seed and a stream number (an entity, a particle).
class Random {
 public:
  constexpr Random(std::uint64_t seed, std::uint64_t stream)
      : key_(mix64(mix64(seed) ^ (stream * 0xd1342543de82ef95ull))) {}

  /// Uniform 64 bits for this counter (a tick, a draw number).
  constexpr std::uint64_t bits(std::uint64_t counter) const { return mix64(key_ ^ mix64(counter)); }
  /// Uniform in [0, 1).
  constexpr double uniform(std::uint64_t counter) const {
    return static_cast<double>(bits(counter) >> 11) * 0x1.0p-53;
  }
  /// Standard normal, [Box1958].
  double normal(std::uint64_t counter) const {
    const double u = 1.0 - uniform(2 * counter);
    const double v = uniform(2 * counter + 1);
    return std::sqrt(-2.0 * std::log(u)) * std::cos(2.0 * std::numbers::pi * v);
  }
  /// Uniform on the unit sphere.
  Vec3 direction(std::uint64_t counter) const {
    const double z = 2.0 * uniform(2 * counter) - 1.0;
    const double angle = 2.0 * std::numbers::pi * uniform(2 * counter + 1);
    const double r = std::sqrt(std::max(0.0, 1.0 - z * z));
    return {r * std::cos(angle), r * std::sin(angle), z};
  }

 private:
  std::uint64_t key_;
};

}  // namespace viscera
