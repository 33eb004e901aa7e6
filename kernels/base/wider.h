// Sixteen numbers at once for loops that are all arithmetic, in one register of 64 bytes or two of
// 32: the sums are made in the same order and the digits are the same.
#pragma once

#include <cstring>

#include "kernels/base/lanes.h"

// One definition each of a function of three of the same name; the fastest that the machine can run
// is chosen when the program starts. See wide.h for the sanitizers.
#if defined(__x86_64__) && !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
#define VISCERA_THREE_TARGETS 1
#define VISCERA_FOR_AVX512 __attribute__((target("avx512f")))
#define VISCERA_FOR_AVX2 __attribute__((target("avx2")))
#define VISCERA_FOR_ANY __attribute__((target("default")))
#else
#define VISCERA_THREE_TARGETS 0
#define VISCERA_FOR_ANY
#endif

namespace viscera {

constexpr int kWiderLanes = 16;
using WiderLanes = float __attribute__((vector_size(64)));

VISCERA_INLINE void load(WiderLanes& to, const float* from) {
  std::memcpy(&to, from, sizeof to);
}

/// An accumulator of sixteen sums as one vector.
struct OneWide {
  using Lanes = WiderLanes;
  static constexpr int kParts = 1;
  static VISCERA_INLINE float sum(const WiderLanes* parts) {
    viscera::Lanes low, high;
    std::memcpy(&low, &parts[0], sizeof low);
    std::memcpy(&high, reinterpret_cast<const char*>(&parts[0]) + sizeof low, sizeof high);
    low += high;
    return viscera::sum(low);
  }
};
/// The same as two.
struct TwoNarrow {
  using Lanes = viscera::Lanes;
  static constexpr int kParts = 2;
  static VISCERA_INLINE float sum(const viscera::Lanes* parts) {
    const viscera::Lanes both = parts[0] + parts[1];
    return viscera::sum(both);
  }
};

}  // namespace viscera
