#include "kernels/smoke/splat_levels.h"

#include <gtest/gtest.h>

#include "kernels/smoke/splat.h"

namespace viscera {
namespace {

SplatParameters on_voxels(double voxel, double viscosity = 1.4e-5) {
  return splat_parameters(Box(Vec3::Zero(), Vec3::Constant(0.1)), voxel, 3e-3, viscosity);
}

TEST(SplatLevels, BlursNeitherMakeNorTakeSmoke) {
  for (const double voxel : {0.2e-3, 0.7e-3, 2e-3, 9e-3}) {
    for (const SplatLevel& level : splat_levels(on_voxels(voxel))) {
      double sum = level.weights.front();
      for (std::size_t i = 1; i < level.weights.size(); ++i) {
        EXPECT_GT(level.weights[i], 0.0f);
        EXPECT_LE(level.weights[i], level.weights[i - 1]);
        sum += 2.0 * level.weights[i];
      }
      EXPECT_EQ(sum, 1.0) << "voxel " << voxel;
    }
  }
}

TEST(SplatLevels, BlursAddUpToTheVarianceOfTheirRadius) {
  for (const double voxel : {0.2e-3, 0.7e-3, 2e-3}) {
    double variance = 1.0 / 6.0;
    float last = 0.0f;
    for (const SplatLevel& level : splat_levels(on_voxels(voxel))) {
      EXPECT_GT(level.square, last);
      last = level.square;
      for (std::size_t i = 1; i < level.weights.size(); ++i)
        variance += 2.0 * level.weights[i] * static_cast<double>(i * i);
      EXPECT_NEAR(variance, level.square / 6.0, 1e-4 * level.square);
    }
  }
}

TEST(SplatLevels, ReachFromOneCellToTheWidestKernel) {
  EXPECT_EQ(splat_levels(on_voxels(9e-3)).size(), 1u);  // 2.5 h is less than a cell
  const std::vector<SplatLevel> levels = splat_levels(on_voxels(2e-3));
  EXPECT_EQ(levels.front().square, 1.0f);
  EXPECT_NEAR(levels.back().square, 3.75 * 3.75, 1e-4);
  EXPECT_EQ(splat_levels(on_voxels(0.1e-3)).back().square, kWidestSplat * kWidestSplat);
  // Without viscosity none is wider than at first.
  EXPECT_NEAR(splat_levels(on_voxels(0.5e-3, 0.0)).back().square, 9.0, 1e-4);
}

}  // namespace
}  // namespace viscera
