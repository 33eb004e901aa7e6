// What droplets of a lognormal distribution of sizes do to light, and how fast they settle.
#pragma once

#include "kernels/smoke/gas_mixture.h"
#include "kernels/smoke/smoke_optics.h"

namespace viscera {

struct Droplets {
  double median = 0.4e-6;    ///< diameter: half of the mass is in smaller ones [m]
  double deviation = 1.8;    ///< geometric standard deviation [1], 1: all of one size
  double density = 1200.0;   ///< [kg/m3]
  double refraction = 1.5;   ///< real part of the refractive index
  double absorption = 0.02;  ///< its imaginary part, not negative
};

/// By Mie's series at one wavelength [m].
SmokeOptics optics_of(const Droplets& droplets, double wavelength);

/// In which the mean of their mass settles in gas: Stokes' law with Cunningham's slip [Hinds1999]
/// [m/s].
double settling_speed(const Droplets& droplets, const GasMixture& mixture);

}  // namespace viscera
