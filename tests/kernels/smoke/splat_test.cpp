#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
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
    EXPECT_NEAR(grid_mass(grid), smoke.book().emitted, 1e-6 * smoke.book().emitted)
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
  parameters.eddies.share = parameters.gravity = 0.0;
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

TEST(Splat, VelocityIsTheMassWeightedMean) {
  SmokeVolume smoke(small_box());
  const Vec3 at = smoke.parameters().domain.center();
  smoke.emit({.position = at,
              .direction = Vec3(1.0, 2.0, -2.0),
              .speed = 0.3,
              .radius = 0.0,
              .mass = 3e-9,
              .particles = 1});
  smoke.emit({.position = at,
              .direction = Vec3(1.0, 2.0, -2.0),
              .speed = 0.06,
              .radius = 0.0,
              .mass = 1e-9,
              .particles = 1});
  SmokeGrid grid;
  splat(smoke, 1e-3, grid);
  const Vec3 mean = Vec3(1.0, 2.0, -2.0) / 3.0 * (0.75 * 0.3 + 0.25 * 0.06);
  std::size_t filled = 0;
  Vec3 momentum = Vec3::Zero();
  for (std::size_t c = 0; c < grid.density.size(); ++c) {
    const Vec3 velocity = grid.velocity[c].cast<double>();
    momentum += grid.density[c] * std::pow(grid.voxel, 3) * velocity;
    if (grid.density[c] <= 0.0f) {
      EXPECT_EQ(velocity, Vec3::Zero());
      continue;
    }
    ++filled;
    EXPECT_LT((velocity - mean).norm(), 1e-4);
  }
  EXPECT_GE(filled, 8u);
  EXPECT_LT((momentum - 4e-9 * mean).norm(), 1e-6 * 4e-9 * mean.norm());
}

TEST(Splat, IsTheSameForAnyOrderOfParticles) {
  SmokeVolume smoke(small_box());
  for (int i = 0; i < 30; ++i) {
    smoke.emit({.position = smoke.parameters().domain.center() + 1e-4 * i * Vec3(1.0, -1.0, 0.5),
                .speed = 0.01 * i,
                .temperature = 3.0 * i,
                .mass = 1e-9 * (1 + i % 7),
                .particles = 10});
  }
  const SmokeParticles& p = smoke.particles();
  const std::vector<Float4> positions(p.positions.rbegin(), p.positions.rend());
  const std::vector<Float4> velocities(p.velocities.rbegin(), p.velocities.rend());
  const std::vector<float> masses(p.masses.rbegin(), p.masses.rend());
  SmokeGrid grid, reversed;
  splat(smoke, 1e-3, grid);
  SplatParameters pass =
      splat_parameters(smoke.parameters().domain, 1e-3, smoke.parameters().spacing,
                       effective_viscosity(smoke.parameters()));
  splat(positions, velocities, masses, pass, reversed);
  EXPECT_EQ(grid.density, reversed.density);
  EXPECT_EQ(grid.temperature, reversed.temperature);
  EXPECT_EQ(grid.velocity, reversed.velocity);
}

TEST(Splat, AKernelsVarianceGrowsWithAgeAsByDiffusion) {
  const double voxel = 1e-3, support = 3e-3, viscosity = 1.4e-5;
  SplatParameters pass =
      splat_parameters(Box(Vec3::Zero(), Vec3::Constant(0.06)), voxel, support, viscosity);
  // Where two cells' shares have the variance of a tent a cell wide, 1/6.
  const auto at = static_cast<float>(voxel * (30.5 + 0.5 - std::sqrt(1.0 / 12.0)));
  for (const float age : {0.0f, 0.005f, 0.02f, 0.07f, 0.15f, 0.29f, 1.0f}) {
    const std::vector<Float4> positions = {{at, at, at, 1.0f}}, velocities = {{0, 0, 0, age}};
    const std::vector<float> masses = {1e-8f};
    SmokeGrid grid;
    splat(positions, velocities, masses, pass, grid);
    double mass = 0.0, first = 0.0, second = 0.0;
    for (std::size_t c = 0; c < grid.density.size(); ++c) {
      const double x = voxel * (static_cast<double>(c % 60) + 0.5);
      mass += grid.density[c];
      first += grid.density[c] * x;
      second += grid.density[c] * x * x;
    }
    const double mean = first / mass, variance = second / mass - mean * mean;
    const double square =
        std::min(0.25 * support * support + 12.0 * viscosity * age, 6.25 * support * support);
    EXPECT_NEAR(mean, at, 1e-7);
    EXPECT_NEAR(variance, square / 6.0, 0.002 * square) << "age " << age;
  }
}

TEST(Splat, WhatIsNowhereIsLeftOut) {
  SplatParameters pass =
      splat_parameters(Box(Vec3::Zero(), Vec3::Constant(0.02)), 1e-3, 3e-3, 1.4e-5);
  const float none = std::numeric_limits<float>::quiet_NaN();
  std::vector<Float4> positions = {{none, 0.01f, 0.01f, 1.0f},
                                   {0.01f, 0.01f, std::numeric_limits<float>::infinity(), 1.0f}};
  std::vector<Float4> velocities(2);
  std::vector<float> masses = {1e-8f, 1e-8f};
  SmokeGrid grid;
  splat(positions, velocities, masses, pass, grid);
  EXPECT_EQ(*std::ranges::max_element(grid.density), 0.0f);
  positions.push_back({0.01f, 0.01f, 0.01f, 1.0f});
  velocities.emplace_back();
  masses.push_back(3e-8f);
  splat(positions, velocities, masses, pass, grid);
  grid.voxel = 1e-3;
  EXPECT_NEAR(grid_mass(grid), 3e-8, 3e-14);
}

TEST(Splat, TheFilledPartHoldsAllSmokeWhereItWas) {
  SmokeVolume smoke(small_box());
  emit_at(smoke, Vec3(0.513, -0.171, 0.128), 1e-8, 40);
  SmokeGrid grid;
  splat(smoke, 1e-3, grid);
  const SmokeGrid part = filled_part(grid);
  EXPECT_LT(part.density.size(), grid.density.size() / 50);
  EXPECT_EQ(part.voxel, grid.voxel);
  EXPECT_DOUBLE_EQ(grid_mass(part), grid_mass(grid));
  EXPECT_LT((part.domain.min() - grid.domain.min() - grid.voxel * part.first.cast<double>()).norm(),
            1e-12);
  std::size_t c = 0;
  for (int z = 0; z < part.size.z(); ++z)
    for (int y = 0; y < part.size.y(); ++y)
      for (int x = 0; x < part.size.x(); ++x, ++c) {
        const Eigen::Vector3i at = part.first + Eigen::Vector3i(x, y, z);
        const auto whole =
            static_cast<std::size_t>(at.x() + grid.size.x() * (at.y() + grid.size.y() * at.z()));
        EXPECT_EQ(part.density[c], grid.density[whole]);
        EXPECT_EQ(part.temperature[c], grid.temperature[whole]);
        EXPECT_EQ(part.velocity[c], grid.velocity[whole]);
      }
}

TEST(Splat, TheFilledPartOfAnEmptyGridIsOneEmptyCell) {
  const SmokeVolume smoke(small_box());
  SmokeGrid grid;
  splat(smoke, 1e-3, grid);
  const SmokeGrid part = filled_part(grid);
  EXPECT_EQ(part.size, Eigen::Vector3i(1, 1, 1));
  EXPECT_EQ(part.density, std::vector<float>{0.0f});
}

}  // namespace
}  // namespace viscera
