// The smoke of particles on a dense grid: density, temperature and velocity.
#pragma once

#include <span>
#include <vector>

#include "kernels/smoke/smoke_passes.h"

namespace viscera {

/// Cell centres on a dense grid, x fastest; fixed-point accumulation, so that the result is the
/// same in any order of summation.
struct SmokeGrid {
  Eigen::Vector3i size = Eigen::Vector3i::Zero();
  Eigen::Vector3i first =
      Eigen::Vector3i::Zero();     ///< number of the first cell, of a part of a grid
  double voxel = 0.0;              ///< [m]
  Box domain;                      ///< of the cells: the smoke's, rounded up to whole cells [m]
  std::vector<float> density;      ///< [kg/m3]                                        (cells)
  std::vector<float> temperature;  ///< excess, mass-weighted mean [K]                 (cells)
  std::vector<Vec3f> velocity;     ///< mass-weighted mean [m/s]                       (cells)
};

/// The box of cells that hold any smoke, with the numbers that they have in `grid`; one empty cell
/// where none does.
SmokeGrid filled_part(const SmokeGrid& grid);

/// What doesn't depend on the particles: a grid of cubic cells over the domain, and the width of
/// kernels for support radius h [m] and viscosity nu [m2/s]: half of h at first, then by diffusion
/// with age, r^2 = h^2/4 + 12 nu t (the variance is r^2/6, as a tent's), up to 2.5 h.
SplatParameters splat_parameters(const Box& domain, double voxel, double support, double viscosity);

/// What the greatest particle carries: mass, heat and a component of momentum.
struct SplatAmounts {
  float mass = 0.0f, heat = 0.0f, momentum = 0.0f;
};
/// Sets the scales so that no particle adds more than 2^30 steps to a cell.
void set_scales(const SplatAmounts& greatest, SplatParameters& parameters);

/// Splats particles with kernels made by splat_levels.h, never narrower than a cell. What a kernel
/// would put outside the grid is mirrored into it: the grid's mass equals the particles' mass to
/// rounding (1e-6 relative). Sets the scales of `parameters` by the greatest of the particles.
/// Sizes the grid's arrays; its voxel and domain are the caller's.
void splat(std::span<const Float4> positions, std::span<const Float4> velocities,
           std::span<const float> masses, SplatParameters& parameters, SmokeGrid& grid);

}  // namespace viscera
