// Light that meets a sphere: Mie's series [Bohren1983].
#pragma once

#include <complex>

namespace viscera {

/// Cross-sections over the sphere's own, pi d^2 / 4, and the mean cosine of what is scattered.
struct MieEfficiencies {
  double extinction = 0.0, scattering = 0.0, asymmetry = 0.0;
};

/// Of a sphere with size parameter x = pi d / wavelength, from 1e-3 to 1e4, and refractive index
/// n + i k over that of the gas, k not negative.
MieEfficiencies mie(double x, std::complex<double> index);

}  // namespace viscera
