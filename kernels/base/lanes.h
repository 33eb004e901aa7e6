// Eight numbers at once, in whatever registers the machine has: the compiler splits them where it
// must, and the digits are the same.
#pragma once

#include <cstring>

namespace viscera {

constexpr int kLanes = 8;
using Lanes = float __attribute__((vector_size(32)));

// Macros of no kind and no arguments by value: vectors of 32 bytes have no ABI of their own on
// machines without AVX, so they go by reference into functions that are always inlined.
#define VISCERA_INLINE inline __attribute__((always_inline))

VISCERA_INLINE void load(Lanes& to, const float* from) {
  std::memcpy(&to, from, sizeof to);
}
VISCERA_INLINE float sum(const Lanes& v) {
  return ((v[0] + v[4]) + (v[1] + v[5])) + ((v[2] + v[6]) + (v[3] + v[7]));
}

}  // namespace viscera
