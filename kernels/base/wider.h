// Sixteen numbers at once for loops that are all arithmetic, in one register of 64 bytes or two of
// 32: the sums are made in the same order and the digits are the same.
#pragma once

#include <cstring>

#include "kernels/base/lanes.h"
#include "kernels/base/wide.h"

namespace viscera {

constexpr int kWiderLanes = 16;
using WiderLanes = float __attribute__((vector_size(64)));

VISCERA_INLINE void load(WiderLanes& to, const float* from) {
  std::memcpy(&to, from, sizeof to);
}

/// The sums of eight vectors, each as sum() makes it, in the order 0, 2, 4, 6, 1, 3, 5, 7.
VISCERA_INLINE void sums_of_eight(const Lanes* of, Lanes& to) {
  Lanes halves[4];
  for (int pair = 0; pair < 4; ++pair) {
    const Lanes &a = of[2 * pair], &b = of[2 * pair + 1];
    halves[pair] = __builtin_shufflevector(a, b, 0, 1, 2, 3, 8, 9, 10, 11) +
                   __builtin_shufflevector(a, b, 4, 5, 6, 7, 12, 13, 14, 15);
  }
  const auto neighbours =
      [](const Lanes& a, const Lanes& b, Lanes& sums) __attribute__((always_inline)) {
    sums = __builtin_shufflevector(a, b, 0, 2, 8, 10, 4, 6, 12, 14) +
           __builtin_shufflevector(a, b, 1, 3, 9, 11, 5, 7, 13, 15);
  };
  Lanes low, high;
  neighbours(halves[0], halves[1], low);
  neighbours(halves[2], halves[3], high);
  neighbours(low, high, to);
}

/// An accumulator of sixteen sums as one vector.
struct OneWide {
  using Lanes = WiderLanes;
  static constexpr int kParts = 1;
  /// The sums of its lower and upper half.
  static VISCERA_INLINE void fold(const WiderLanes* parts, viscera::Lanes& both) {
    viscera::Lanes high;
    std::memcpy(&both, &parts[0], sizeof both);
    std::memcpy(&high, reinterpret_cast<const char*>(&parts[0]) + sizeof both, sizeof high);
    both += high;
  }
};
/// The same as two.
struct TwoNarrow {
  using Lanes = viscera::Lanes;
  static constexpr int kParts = 2;
  static VISCERA_INLINE void fold(const viscera::Lanes* parts, viscera::Lanes& both) {
    both = parts[0] + parts[1];
  }
};

}  // namespace viscera
