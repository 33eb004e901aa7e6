// Functions of eight numbers at once.
#pragma once

#include <cstdint>

#include "kernels/base/lanes.h"

namespace viscera {

using LaneInts = std::int32_t __attribute__((vector_size(32)));

VISCERA_INLINE void store(float* to, const Lanes& from) {
  std::memcpy(to, &from, sizeof from);
}
VISCERA_INLINE void keep_greater(Lanes& most, const Lanes& v) {
  most = v > most ? v : most;
}
VISCERA_INLINE float greatest(const Lanes& v) {
  float most = v[0];
  for (int l = 1; l < kLanes; ++l) most = v[l] > most ? v[l] : most;
  return most;
}

/// e^x within 2e-7 of itself; x beyond [-87, 88] counts as that. Halves, then the polynomial of
/// Cephes' expf on what is left; the exponent's bits are put together by hand.
VISCERA_INLINE void exponential(Lanes& out, const Lanes& given) {
  constexpr float kRound = 12582912.0f;  // 1.5 * 2^23: adding and taking it rounds
  const Lanes zero = {};
  Lanes x = given < zero - 87.0f ? zero - 87.0f : given;
  x = x > zero + 88.0f ? zero + 88.0f : x;
  const Lanes halves = (x * 1.44269504f + kRound) - kRound;
  const Lanes r = (x - halves * 0.693359375f) - halves * -2.12194440e-4f;
  Lanes p = r * 1.9875691500e-4f + 1.3981999507e-3f;
  p = p * r + 8.3334519073e-3f;
  p = p * r + 4.1665795894e-2f;
  p = p * r + 1.6666665459e-1f;
  p = p * r + 5.0000001201e-1f;
  p = p * (r * r) + r + 1.0f;
  const LaneInts bits = (__builtin_convertvector(halves, LaneInts) + 127) << 23;
  Lanes scale;
  std::memcpy(&scale, &bits, sizeof scale);
  out = p * scale;
}

/// Square root of x >= 0 within 3e-7 of itself: Newton's steps for its inverse from a guess by the
/// exponent's bits, which don't wait for a division and give the same digits everywhere.
VISCERA_INLINE void square_root(Lanes& out, const Lanes& x) {
  LaneInts bits;
  std::memcpy(&bits, &x, sizeof bits);
  bits = 0x5f3759df - (bits >> 1);
  Lanes inverse;
  std::memcpy(&inverse, &bits, sizeof inverse);
  const Lanes half = 0.5f * x;
  inverse *= 1.5f - half * inverse * inverse;
  inverse *= 1.5f - half * inverse * inverse;
  inverse *= 1.5f - half * inverse * inverse;
  out = x * inverse;
}

/// The angle whose tangent is x >= 0, within 2e-7: a polynomial up to 45 degrees
/// [Abramowitz1964, 4.4.49], the rest by its complement.
VISCERA_INLINE void arc_tangent(Lanes& out, const Lanes& x) {
  const Lanes zero = {}, one = zero + 1.0f;
  const Lanes w = x > one ? one / x : x;
  const Lanes s = w * w;
  Lanes p = s * 0.0028662257f - 0.0161657367f;
  p = p * s + 0.0429096138f;
  p = p * s - 0.0752896400f;
  p = p * s + 0.1065626393f;
  p = p * s - 0.1420889944f;
  p = p * s + 0.1999355085f;
  p = p * s - 0.3333314528f;
  p = (p * s + 1.0f) * w;
  out = x > one ? 1.57079633f - p : p;
}

}  // namespace viscera
