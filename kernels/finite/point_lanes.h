// A number of each point of a pack, in a register. What is made of these is always inlined: how
// they would be passed depends on the instructions that a function may use.
#pragma once

#include <cstddef>
#include <cstring>

namespace viscera::point_lanes {

/// What is read once from one end to the other, in pieces that are too short for a machine to
/// foresee, is asked for so many entries ahead, a kilobyte or so. Chosen; measured with and
/// without.
constexpr std::size_t kEntriesAhead = 24;

using Lanes = double __attribute__((vector_size(32)));
using FloatLanes = float __attribute__((vector_size(16)));

#define VISCERA_INLINE [[gnu::always_inline]] inline

VISCERA_INLINE void load(const double* from, Lanes& to) {
  std::memcpy(&to, from, sizeof(to));
}

// Numbers one by one: GCC 12 makes one instruction of that, and seven of __builtin_convertvector.
VISCERA_INLINE void load(const float* from, Lanes& to) {
  to = Lanes{from[0], from[1], from[2], from[3]};
}

VISCERA_INLINE void narrow(const Lanes& from, FloatLanes& to) {
  to = FloatLanes{static_cast<float>(from[0]), static_cast<float>(from[1]),
                  static_cast<float>(from[2]), static_cast<float>(from[3])};
}

VISCERA_INLINE void store(const Lanes& from, double* to) {
  std::memcpy(to, &from, sizeof(from));
}

VISCERA_INLINE double sum_of(const Lanes& x) {
  return (x[0] + x[1]) + (x[2] + x[3]);
}

/// Rows of the cofactor matrix of F, all row by row.
VISCERA_INLINE void cofactors(const Lanes* f, Lanes* c) {
  c[0] = f[4] * f[8] - f[5] * f[7];
  c[1] = f[5] * f[6] - f[3] * f[8];
  c[2] = f[3] * f[7] - f[4] * f[6];
  c[3] = f[2] * f[7] - f[1] * f[8];
  c[4] = f[0] * f[8] - f[2] * f[6];
  c[5] = f[1] * f[6] - f[0] * f[7];
  c[6] = f[1] * f[5] - f[2] * f[4];
  c[7] = f[2] * f[3] - f[0] * f[5];
  c[8] = f[0] * f[4] - f[1] * f[3];
}

/// How they change as F changes by d.
template <class Numbers>
VISCERA_INLINE void change_of_cofactors(const Numbers* f, const Numbers* d, Numbers* c) {
  c[0] = d[4] * f[8] + f[4] * d[8] - d[5] * f[7] - f[5] * d[7];
  c[1] = d[5] * f[6] + f[5] * d[6] - d[3] * f[8] - f[3] * d[8];
  c[2] = d[3] * f[7] + f[3] * d[7] - d[4] * f[6] - f[4] * d[6];
  c[3] = d[2] * f[7] + f[2] * d[7] - d[1] * f[8] - f[1] * d[8];
  c[4] = d[0] * f[8] + f[0] * d[8] - d[2] * f[6] - f[2] * d[6];
  c[5] = d[1] * f[6] + f[1] * d[6] - d[0] * f[7] - f[0] * d[7];
  c[6] = d[1] * f[5] + f[1] * d[5] - d[2] * f[4] - f[2] * d[4];
  c[7] = d[2] * f[3] + f[2] * d[3] - d[0] * f[5] - f[0] * d[5];
  c[8] = d[0] * f[4] + f[0] * d[4] - d[1] * f[3] - f[1] * d[3];
}

}  // namespace viscera::point_lanes
