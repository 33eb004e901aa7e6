// What the smoke of one volume consists of: the particles, their parameters and their counters.
#pragma once

#include <cstdint>
#include <vector>

#include "kernels/base/types.h"

namespace viscera {

/// Structure of arrays over the live particles; order changes from step to step, `ids` don't.
struct SmokeParticles {
  std::vector<Vec3f> positions;     ///< relative to the domain's least corner [m]   (n)
  std::vector<Vec3f> velocities;    ///< [m/s]                                        (n)
  std::vector<float> temperatures;  ///< excess over the gas [K]                      (n)
  std::vector<float> masses;        ///< of smoke carried [kg]                        (n)
  std::vector<float> ages;          ///< [s]                                          (n)
  std::vector<std::uint32_t> ids;   ///< number of emission: key of its random stream (n)

  std::size_t size() const { return positions.size(); }
  std::size_t memory_bytes() const {
    return 2 * positions.capacity() * sizeof(Vec3f) + 4 * ids.capacity() * sizeof(float);
  }
};

struct SmokeParameters {
  Box domain;                       ///< closed cavity: particles slide along its walls; world [m]
  double spacing = 3e-3;            ///< smoothing length h (support radius) of the particles [m]
  double gas_density = 1.76;        ///< rho [kg/m3] (CO2 at 12 mmHg and 37 C)
  double gas_viscosity = 1.54e-5;   ///< mu [Pa s]
  double gas_temperature = 310.15;  ///< [K]
  double cooling_time = 0.8;        ///< of the temperature excess towards the gas [s]
  double gravity = 9.81;            ///< [m/s2]; buoyancy acts along +z
  double lifetime = 20.0;           ///< particles retire at this age [s]
  std::uint64_t seed = 1;
  std::size_t max_particles = 25000;  ///< the oldest end when more are emitted, and are counted

  /// White part of the random force per mass: the standard deviation of each component over 1/60 s
  /// [m/s2]; scaled by sqrt((1/60 s) / dt), so that the diffusion doesn't depend on the step.
  double random_acceleration = 0.15;
  /// Coherent part of the random force per mass, which makes wisps: root mean square of the length
  /// of a divergence-free field of random waves [m/s2], that neighbours share.
  double swirl_acceleration = 1.0;
  double swirl_wavelength = 20e-3;  ///< of its waves, spread from 0.25 to 1.5 times this [m]
  double swirl_time = 0.6;          ///< in which those of this wavelength change [s]
  /// A hot plume makes its own turbulence: both parts of the random force grow by the factor
  /// 1 + plume_turbulence * (temperature excess / gas temperature).
  double plume_turbulence = 10.0;

  /// Added to mu / rho [m2/s]: eddies smaller than h.
  double eddy_viscosity = 5e-6;
  /// Gas fills the part of a particle's neighbourhood that other particles leave empty. At rest it
  /// would drag with the factor 1 (smoke_forces.h); it moves along with the smoke that it
  /// surrounds, and the rest of the drag is this share of that, chosen for a plume that rises at
  /// 0.1-0.3 m/s.
  double surrounding_drag = 0.3;
  /// Quadratic drag a = -c |v| v of the gas that a plume entrains: c = 2 alpha / b with
  /// the entrainment coefficient alpha of plumes, about 0.1 [Morton1956], and plume radius b, 1 cm
  /// [1/m].
  double entrainment = 20.0;
  /// Gas can't pile up: particles closer than h/2 on average push each other apart with the
  /// pressure rho c^2 of their excess (smoke_forces.h); c [m/s].
  double crowding_speed = 0.02;
};

struct SmokeCounters {
  std::uint64_t emitted = 0, left_domain = 0, retired = 0;  ///< particles
  std::uint64_t crowded_out = 0;  ///< of the retired, those younger than the lifetime
  std::uint64_t isolated = 0;     ///< particles without enough neighbours, last step: no viscosity
  double emitted_mass = 0.0, left_mass = 0.0, retired_mass = 0.0;  ///< [kg]
};

struct SmokeEmission {
  Vec3 position = Vec3::Zero();    ///< world [m]
  Vec3 direction = Vec3::UnitZ();  ///< of the jet: outward from the tissue
  double speed = 0.15;             ///< [m/s]
  double radius = 1e-3;            ///< of the source [m]
  double temperature = 60.0;       ///< excess over the gas [K]
  double mass = 0.0;               ///< of smoke to emit in this step [kg]
  int particles = 0;               ///< number to emit in this step; without any, no mass leaves
  double duration = 0.0;           ///< over which they left [s]: spreads them along the jet
};

}  // namespace viscera
