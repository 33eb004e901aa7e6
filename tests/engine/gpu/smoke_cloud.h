// Clouds of smoke, passes and a ball, for parity of the CPU's and the GPU's smoke.
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "kernels/base/random.h"
#include "kernels/smoke/smoke_particles.h"
#include "kernels/smoke/surface_cells.h"
#include "tests/support/shapes.h"

namespace viscera {

constexpr float kSmokeSupport = 3e-3f;

/// Particles in a box of 60 mm, in no order: three quarters of them in a dense ball, of half the
/// normal spacing, the rest spread, so that many are alone.
inline SmokeParticles smoke_cloud(int count, std::uint64_t seed) {
  SmokeParticles particles;
  particles.resize(static_cast<std::size_t>(count));
  // The ball that holds them at h/2 or a little less.
  const double ball = std::min(0.028, 0.55 * 3e-3 * std::cbrt(0.75 * count / 8.0 * 0.75));
  for (int i = 0; i < count; ++i) {
    const Random random(seed, static_cast<std::uint64_t>(i));
    Vec3 at = Vec3::Constant(0.03);
    if (i % 4 != 0) {
      at += ball * std::cbrt(random.uniform(1)) * random.direction(0);
    } else {
      at = 0.06 * Vec3(random.uniform(1), random.uniform(2), random.uniform(3));
    }
    const Vec3 velocity = 0.1 * Vec3(random.normal(10), random.normal(11), 1.0 + random.normal(12));
    const auto n = static_cast<std::size_t>(i);
    particles.positions[n] =
        Float4::from(at.cast<float>(), static_cast<float>(60.0 * random.uniform(20)));
    particles.velocities[n] =
        Float4::from(velocity.cast<float>(), static_cast<float>(3.0 * random.uniform(21)));
    particles.masses[n] = static_cast<float>(1e-8 * (0.5 + random.uniform(22)));
    particles.ids[n] = static_cast<std::uint32_t>(i);
  }
  return particles;
}

inline ViscosityParameters smoke_viscosity(Laplacian laplacian) {
  ViscosityParameters pass;
  pass.inverse_square = 1.0f / (kSmokeSupport * kSmokeSupport);
  pass.viscosity = 1.4e-5f;
  pass.crowding = 2e-4f;
  pass.fill = 0.196f;
  pass.most_excess = 4.0f;
  pass.gas_drag = 28.0f;
  pass.fewest_neighbours = 4;
  pass.laplacian = laplacian;
  pass.step = 1.0f / 60.0f;
  return pass;
}

inline IntegrateParameters smoke_integration() {
  IntegrateParameters pass;
  pass.extent = {0.06f, 0.06f, 0.06f, 0.2f};
  pass.step = 1.0f / 60.0f;
  pass.white = 0.15f;
  pass.gravity = 9.81f;
  pass.gas_temperature = 310.15f;
  pass.turbulence = 0.25f;
  pass.cooling = 1.3f;
  pass.seed = 77;
  pass.substep = 12;
  pass.open_sides = kOpenHighX;
  pass.entrainment = 50.0f;
  return pass;
}

/// A ball of unit radius.
struct BallSurface {
  std::vector<Vec3> directions;
  std::vector<SurfaceTopology::Triangle> triangles;

  BallSurface() {
    const TriangleSurface ball = test::icosphere(1.0, 2);
    directions = ball.vertices;
    for (const auto& t : ball.triangles) triangles.emplace_back(t[0], t[1], t[2]);
  }
};

}  // namespace viscera
