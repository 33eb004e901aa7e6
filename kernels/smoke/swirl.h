// The coherent part of the eddies that carry smoke: a smooth, divergence-free field that neighbours
// share. White noise alone blurs a plume; this draws it out into wisps.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "kernels/smoke/smoke_passes.h"

namespace viscera {

/// A sum of transverse waves a(x, t) = sum_m e_m f(k_m . x + w_m t + p_m), f a sine, with e_m
/// normal to k_m: the curl of a band-limited random vector potential, so its divergence vanishes
/// [Bridson2007].
class SwirlField {
 public:
  static constexpr int kWaves = 24;

  /// `size` is the root mean square of the length; wavelengths lie between 0.25 and 1.5 of
  /// `wavelength` L [m], frequencies between 0.5 and 1.5 of (L / length)^(2/3) / period [1/s], as
  /// eddies of an inertial range turn over. A size of zero costs nothing.
  SwirlField(std::uint64_t seed, double size, double wavelength, double period);

  /// The waves at time t [s]; none without amplitude.
  std::vector<SwirlWave> waves(double t) const;

 private:
  struct Wave {
    Vec3f amplitude;
    Vec3f wave_number;  // [1/m], in turns
    double frequency;   // [1/s]
    double phase;       // in turns
  };
  std::array<Wave, kWaves> waves_;
  bool active_;
};

/// Positions and accelerations of a block of particles, by component.
struct SwirlBlock {
  static constexpr int kSize = 64;
  alignas(32) std::array<float, kSize> x, y, z, ax, ay, az;
};

/// The field of the waves at the block's positions.
void sum_swirl(std::span<const SwirlWave> waves, SwirlBlock& block);

}  // namespace viscera
