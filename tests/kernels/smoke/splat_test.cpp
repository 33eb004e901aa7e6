#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "kernels/smoke/smoke.h"

namespace viscera {
namespace {

SmokeParameters small_box() {
  SmokeParameters parameters;
  parameters.domain = Box(Vec3(0.5, -0.2, 0.1), Vec3(0.54, -0.16, 0.15));
  return parameters;
}

void emit_at(SmokeVolume& smoke, const Vec3& position, double mass, int particles) {
  smoke.emit({.position = position, .speed = 0.0, .mass = mass, .particles = particles});
}

double grid_mass(const SmokeGrid& grid) {
  return std::accumulate(grid.density.begin(), grid.density.end(), 0.0) * std::pow(grid.voxel, 3);
}

TEST(Splat, GridCoversTheDomainWithCubicCells) {
  const SmokeVolume smoke(small_box());
  SmokeGrid grid;
  splat(smoke, 1e-3, grid);
  EXPECT_EQ(grid.size, Eigen::Vector3i(40, 40, 50));
  EXPECT_TRUE(grid.domain.isApprox(smoke.parameters().domain));
  splat(smoke, 3e-3, grid);
  EXPECT_EQ(grid.size, Eigen::Vector3i(14, 14, 17));
  EXPECT_TRUE(grid.domain.contains(smoke.parameters().domain));
  EXPECT_EQ(grid.density.size(), 14u * 14u * 17u);
  EXPECT_EQ(*std::ranges::max_element(grid.density), 0.0f);
}

TEST(Splat, MassIsTheParticlesMassAtBordersToo) {
  for (const double voxel : {0.7e-3, 2e-3, 9e-3, 0.1}) {
    SmokeVolume smoke(small_box());
    const Box domain = smoke.parameters().domain;
    for (int corner = 0; corner < 8; ++corner) {
      emit_at(smoke, domain.corner(static_cast<Box::CornerType>(corner)), 1e-9 * (1 + corner), 20);
    }
    emit_at(smoke, domain.center(), 3e-7, 200);
    SmokeGrid grid;
    splat(smoke, voxel, grid);
    EXPECT_NEAR(grid_mass(grid), smoke.counters().emitted_mass,
                1e-6 * smoke.counters().emitted_mass)
        << "voxel " << voxel;
  }
}

TEST(Splat, PutsSmokeWhereTheParticlesAreWithTheirTemperature) {
  SmokeVolume smoke(small_box());
  const Vec3 at(0.5121, -0.1833, 0.1317);
  smoke.emit({.position = at,
              .speed = 0.0,
              .radius = 0.0,
              .temperature = 42.0,
              .mass = 1e-8,
              .particles = 1});
  SmokeGrid grid;
  splat(smoke, 1e-3, grid);
  Vec3 centre = Vec3::Zero();
  std::size_t filled = 0;
  for (std::size_t c = 0; c < grid.density.size(); ++c) {
    if (grid.density[c] <= 0.0f) {
      EXPECT_EQ(grid.temperature[c], 0.0f);
      continue;
    }
    ++filled;
    EXPECT_NEAR(grid.temperature[c], 42.0, 0.01);
    const Vec3 cell(c % 40, c / 40 % 40, c / 1600);
    centre += grid.density[c] * std::pow(grid.voxel, 3) / 1e-8 *
              (grid.domain.min() + ((cell.array() + 0.5) * grid.voxel).matrix());
  }
  EXPECT_GT(filled, 8u);
  EXPECT_LT(filled, 65u);
  EXPECT_LT((centre - at).norm(), 0.3e-3);
}

TEST(Splat, SmokeSpreadsWithAge) {
  SmokeParameters parameters = small_box();
  parameters.random_acceleration = parameters.swirl_acceleration = parameters.gravity = 0.0;
  SmokeVolume smoke(parameters);
  smoke.emit({.position = parameters.domain.center(),
              .speed = 0.0,
              .radius = 0.0,
              .mass = 1e-8,
              .particles = 1});
  SmokeGrid grid;
  splat(smoke, 1e-3, grid);
  const float young = *std::ranges::max_element(grid.density);
  smoke.step(0.3);
  splat(smoke, 1e-3, grid);
  EXPECT_LT(*std::ranges::max_element(grid.density), 0.1f * young);
  EXPECT_NEAR(grid_mass(grid), 1e-8, 1e-14);
}

}  // namespace
}  // namespace viscera
