// Smoke particles: the step of one smoke volume on the CPU, and its density on a grid.
// [De2006] eq. 13-15; the gas grid and the GPU twin come with the next version.
#pragma once

#include <cstdint>
#include <vector>

#include "kernels/base/types.h"
#include "kernels/smoke/smoke_bins.h"
#include "kernels/smoke/smoke_forces.h"
#include "kernels/smoke/smoke_particles.h"
#include "kernels/smoke/swirl.h"

namespace viscera {

/// The smoke of one volume. Deterministic for any number of threads. Mass is booked: what was
/// emitted is airborne, has left (particles emitted outside the domain leave at once) or is
/// retired.
class SmokeVolume {
 public:
  explicit SmokeVolume(const SmokeParameters& parameters);

  /// Particles appear evenly in a ball about the source, all with the jet's velocity. An emission
  /// that isn't finite, or has no positive mass or number, emits nothing.
  void emit(const SmokeEmission& emission);
  /// Advances by dt [s]. [De2006] eq. 14. Particles exchange momentum as often as the explicit
  /// viscosity bound dt <= 0.05 h^2 / nu asks for (once a frame of 1/60 s with the defaults); in
  /// between they move in substeps of at most h/2 (at most 32).
  void step(double dt);

  const SmokeParticles& particles() const { return particles_; }
  const SmokeParameters& parameters() const { return parameters_; }
  const SmokeCounters& counters() const { return counters_; }
  double time() const { return time_; }  ///< since the start [s]
  std::size_t memory_bytes() const;

 private:
  void exchange_and_move(double dt);
  void move(double dt);
  void retire_aged();
  void retire_oldest(std::size_t count);
  void remove(const std::vector<std::uint8_t>& ending);

  SmokeParameters parameters_;
  SmokeParticles particles_;
  SmokeCounters counters_;
  SwirlField swirl_;
  SmokeBins bins_;
  SmokeForces forces_;
  double time_ = 0.0;
  std::uint64_t substeps_ = 0;
  std::uint32_t next_id_ = 0;
};

/// Density and temperature on a dense grid of cell centres, x fastest; fixed-point accumulation, so
/// that the result is the same in any order of summation.
struct SmokeGrid {
  Eigen::Vector3i size = Eigen::Vector3i::Zero();
  double voxel = 0.0;              ///< [m]
  Box domain;                      ///< of the cells: the smoke's, rounded up to whole cells [m]
  std::vector<float> density;      ///< [kg/m3]
  std::vector<float> temperature;  ///< excess, mass-weighted mean [K]
};

/// Splats particles on cubic cells of edge `voxel` [m] with a tent kernel as wide as the particle's
/// smoke has spread: half the smoothing length at first, then by diffusion with age,
/// r^2 = h^2/4 + 12 nu t (a tent's variance is r^2/6), up to 2.5 h, and never narrower than a cell.
/// What a kernel would put outside the grid goes to the cells inside: the grid's mass equals the
/// particles' mass to fixed-point rounding (1e-6 relative).
void splat(const SmokeVolume& smoke, double voxel, SmokeGrid& grid);

}  // namespace viscera
