// Smoke particles: state, parameters and the step of one smoke volume on the CPU.
// [De2006] eq. 13-15; the gas grid and the GPU twin come with the next version.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "kernels/base/types.h"

namespace viscera {

/// Structure of arrays over the live particles; order changes from step to step, `ids` don't.
struct SmokeParticles {
  std::vector<Vec3f> positions;       ///< relative to the domain's least corner [m]   (n)
  std::vector<Vec3f> velocities;      ///< [m/s]                                        (n)
  std::vector<float> temperatures;    ///< excess over the gas [K]                      (n)
  std::vector<float> masses;          ///< of smoke carried [kg]                        (n)
  std::vector<float> ages;            ///< [s]                                          (n)
  std::vector<std::uint32_t> ids;     ///< number of emission: key of its random stream (n)

  std::size_t size() const { return positions.size(); }
};

struct SmokeParameters {
  Box domain;                         ///< world [m]
  double spacing = 3e-3;              ///< smoothing length h of the particle field [m]
  double gas_density = 1.76;          ///< rho [kg/m3] (CO2 at 12 mmHg and 37 C)
  double gas_viscosity = 1.54e-5;     ///< mu [Pa s]
  double gas_temperature = 310.15;    ///< [K]
  double random_acceleration = 0.6;   ///< standard deviation of the random force per mass [m/s2]
  double cooling_time = 0.8;          ///< of the temperature excess towards the gas [s]
  double gravity = 9.81;              ///< [m/s2]; buoyancy acts along +z
  std::uint64_t seed = 1;
  std::size_t max_particles = 25000;  ///< the oldest end when more are emitted, and are counted
};

struct SmokeCounters {
  std::uint64_t emitted = 0, left_domain = 0, retired = 0;   ///< particles
  std::uint64_t isolated = 0;        ///< particles without enough neighbours, last step: no viscosity
  double emitted_mass = 0.0, left_mass = 0.0, retired_mass = 0.0;   ///< [kg]
};

struct SmokeEmission {
  Vec3 position = Vec3::Zero();       ///< world [m]
  Vec3 direction = Vec3::UnitZ();     ///< of the jet: outward from the tissue
  double speed = 0.15;                ///< [m/s]
  double radius = 1e-3;               ///< of the source [m]
  double temperature = 60.0;          ///< excess over the gas [K]
  double mass = 0.0;                  ///< of smoke to emit in this step [kg]
  int particles = 0;                  ///< number to emit in this step
};

/// The smoke of one volume. Deterministic for any number of threads.
class SmokeVolume {
 public:
  explicit SmokeVolume(const SmokeParameters& parameters);

  void emit(const SmokeEmission& emission);
  /// Advances by dt [s] in as many substeps as the explicit viscosity bound dt <= 0.1 h^2 rho / mu
  /// and a displacement of h/2 a substep ask for. [De2006] eq. 14.
  void step(double dt);

  const SmokeParticles& particles() const { return particles_; }
  const SmokeParameters& parameters() const { return parameters_; }
  const SmokeCounters& counters() const { return counters_; }
  std::size_t memory_bytes() const;

 private:
  void bin();
  void substep(double dt);
  void retire();

  SmokeParameters parameters_;
  SmokeParticles particles_;
  SmokeCounters counters_;
  std::uint64_t steps_ = 0;
  std::uint32_t next_id_ = 0;
  // Scratch of the step, kept to avoid allocation.
  SmokeParticles sorted_;
  std::vector<std::uint32_t> cell_begin_, cell_of_, order_;
  std::vector<Vec3f> accelerations_;
};

/// Density and temperature on a dense grid of cell centres, x fastest; fixed-point accumulation, so
/// that the result is the same in any order of summation.
struct SmokeGrid {
  Eigen::Vector3i size = Eigen::Vector3i::Zero();
  double voxel = 0.0;                 ///< [m]
  Box domain;                         ///< [m]
  std::vector<float> density;         ///< [kg/m3]
  std::vector<float> temperature;     ///< excess, mass-weighted mean [K]
};

/// Splats particles with a tent kernel of the particle's smoothing length on cells of about `voxel`.
/// The grid's mass equals the particles' mass to fixed-point rounding (1e-6 relative).
void splat(const SmokeVolume& smoke, double voxel, SmokeGrid& grid);

}  // namespace viscera
