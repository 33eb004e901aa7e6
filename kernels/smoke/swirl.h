// The coherent part of the random force on smoke: a smooth, divergence-free field of acceleration
// that neighbours share. White noise alone blurs a plume; this draws it out into wisps.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "kernels/base/types.h"

namespace viscera {

/// A sum of transverse waves a(x, t) = sum_m e_m f(k_m . x + w_m t + p_m), f a sine, with e_m
/// normal to k_m: the curl of a band-limited random vector potential, so its divergence vanishes
/// [Bridson2007].
class SwirlField {
 public:
  static constexpr int kWaves = 24;

  /// `acceleration` is the root mean square of the length [m/s2]; wavelengths lie between 0.25 and
  /// 1.5 of `wavelength` L [m], frequencies between 0.5 and 1.5 of (L / length)^(2/3) / period
  /// [1/s], as eddies of an inertial range turn over. Zero acceleration costs nothing.
  SwirlField(std::uint64_t seed, double acceleration, double wavelength, double period);

  /// Adds the field at time t [s], times a factor of each particle, at n positions [m] to n
  /// accelerations [m/s2].
  void add(double t, std::span<const Vec3f> positions, std::span<const float> factors,
           std::span<Vec3f> accelerations) const;

 private:
  struct Wave {
    Vec3f amplitude;    // [m/s2]
    Vec3f wave_number;  // [1/m], in turns
    double frequency;   // [1/s]
    double phase;       // in turns
  };
  std::array<Wave, kWaves> waves_;
  bool active_;
};

}  // namespace viscera
