// The decay of flows by viscosity in smoke, whatever computes it: a shear wave v = (sin kz, 0, 0)
// shrinks at the rate nu k^2, a vortex v = (sin kx cos ky, -cos kx sin ky, 0) at twice that.
#pragma once

#include <cstdint>
#include <optional>

#include "kernels/smoke/step_passes.h"

namespace viscera {

/// The relative error of the rate by `passes`, on a lattice of `across` spacings a wavelength, each
/// particle moved by up to `jitter` spacings along each axis, filling a periodic cube (images stand
/// around it). Over a tenth of the amplitude, in explicit steps whose own error is taken out.
/// Nothing where the passes fail.
std::optional<double> shear_decay_error(SmokePasses& passes, Laplacian laplacian, int across,
                                        double jitter, std::uint64_t seed);

/// The same of the vortex.
std::optional<double> vortex_decay_error(SmokePasses& passes, Laplacian laplacian, int across,
                                         double jitter, std::uint64_t seed);

}  // namespace viscera
