// Forces on the parcels and their motion: dv/dt = (mu lap v + f) / rho [De2006] eq. 14.
#pragma once

#include <span>

#include "kernels/smoke/smoke_passes.h"

namespace viscera {

/// Three words from three by pcg3d [Jarzynski2020]: the same on the CPU and in GLSL.
struct RandomWords {
  std::uint32_t x, y, z;
};
constexpr RandomWords random_words(std::uint32_t x, std::uint32_t y, std::uint32_t z) {
  x = x * 1664525u + 1013904223u;
  y = y * 1664525u + 1013904223u;
  z = z * 1664525u + 1013904223u;
  x += y * z, y += z * x, z += x * y;
  x ^= x >> 16, y ^= y >> 16, z ^= z >> 16;
  x += y * z, y += z * x, z += x * y;
  return {x, y, z};
}

/// A standard normal number to the accuracy that a random force needs: the sum of a word's four
/// bytes (mean 0, variance 1, bounded at 3.5).
constexpr float nearly_normal(std::uint32_t word) {
  const std::uint32_t bytes =
      (word & 0xff) + (word >> 8 & 0xff) + (word >> 16 & 0xff) + (word >> 24);
  return (static_cast<float>(bytes) - 510.0f) * (1.0f / 147.8005f);  // 4 (256^2 - 1) / 12
}

/// Advances by a step. Neighbours' accelerations (w: drag rate of the gas around), where gravity is
/// given the buoyancy of a warm parcel as an ideal gas, and drag towards the gas and the eddies in
/// it, implicit, so that no step makes it overshoot:
///   v' = (v + dt (a + k u')) / (1 + dt k),  k = drag + entrainment |v - u|,
///   u' = u + eddies (swirl that neighbours share + white part of each).
/// The gas takes heat as it takes momentum, times `cooling`. `gas` is u with the speed of its
/// eddies in w; empty where the gas rests, and the eddies are a share of a parcel's speed. Closed
/// sides of the domain stop a particle inelastically; through open ones it leaves, and its position
/// tells.
void integrate(std::span<Float4> positions, std::span<Float4> velocities,
               std::span<const std::uint32_t> ids, std::span<const Float4> accelerations,
               std::span<const Float4> gas, std::span<const SwirlWave> waves,
               const IntegrateParameters& parameters);

}  // namespace viscera
