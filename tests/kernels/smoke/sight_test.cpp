#include "kernels/smoke/sight.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>

namespace viscera {
namespace {

constexpr double kDensity = 2e-3;                              // [kg/m3]
constexpr double kExtinction = SmokeOptics{}.mass_extinction;  // [m2/kg]

/// Cells of 5 mm over a slab 3 cm thick in y, from y = 0.02 to 0.05.
SmokeGrid slab(float density) {
  SmokeGrid grid;
  grid.size = Eigen::Vector3i(20, 6, 20);
  grid.voxel = 5e-3;
  grid.domain = Box(Vec3(-0.05, 0.02, -0.05), Vec3(0.05, 0.05, 0.05));
  grid.density.assign(20 * 6 * 20, density);
  return grid;
}

double depth_through(std::initializer_list<const SmokeGrid*> grids, const Vec3& from,
                     const Vec3& to, double background = 0.0) {
  const std::vector<const SmokeGrid*> list(grids);
  return optical_depth({list, background, {}}, from, to);
}

TEST(Sight, AnEvenSlabTakesWhatItsThicknessSays) {
  const SmokeGrid grid = slab(kDensity);
  const double across = kExtinction * kDensity * 0.03;
  EXPECT_NEAR(depth_through({&grid}, Vec3(0, -0.05, 0), Vec3(0, 0.1, 0)), across, 1e-6 * across);
  EXPECT_NEAR(depth_through({&grid}, Vec3(0, 0.1, 0), Vec3(0, -0.05, 0)), across, 1e-6 * across);
  // Aslant: longer by the secant.
  const double secant = std::sqrt(0.15 * 0.15 + 0.03 * 0.03) / 0.15;
  EXPECT_NEAR(depth_through({&grid}, Vec3(-0.015, -0.05, 0), Vec3(0.015, 0.1, 0)), across * secant,
              1e-6 * across);
}

TEST(Sight, OnlySmokeBetweenTheTwoPointsCounts) {
  const SmokeGrid grid = slab(kDensity);
  const double half = kExtinction * kDensity * 0.015;
  EXPECT_NEAR(depth_through({&grid}, Vec3(0, 0, 0), Vec3(0, 0.035, 0)), half, 1e-6 * half);
  EXPECT_NEAR(depth_through({&grid}, Vec3(0, 0.035, 0), Vec3(0, 0.2, 0)), half, 1e-6 * half);
  EXPECT_EQ(depth_through({&grid}, Vec3(0, 0, 0), Vec3(0, 0.019, 0)), 0.0);
  EXPECT_EQ(depth_through({&grid}, Vec3(0.2, 0, 0), Vec3(0.2, 0.1, 0)), 0.0);
  EXPECT_EQ(depth_through({&grid}, Vec3(0, 0.03, 0), Vec3(0, 0.03, 0)), 0.0);
}

TEST(Sight, OverlappingVolumesAndTheBackgroundAddUp) {
  const SmokeGrid one = slab(kDensity), other = slab(3 * kDensity), empty;
  const double across = kExtinction * kDensity * 0.03;
  EXPECT_NEAR(depth_through({&one, &other, &empty}, Vec3(0, 0, 0), Vec3(0, 0.1, 0), 1e-3),
              4 * across + kExtinction * 1e-3 * 0.1, 1e-5 * across);
}

TEST(Sight, ADensityThatGrowsEvenlyIsIntegratedExactly) {
  SmokeGrid grid = slab(0.0f);
  std::size_t index = 0;
  for (int z = 0; z < 20; ++z)
    for (int y = 0; y < 6; ++y)
      for (int x = 0; x < 20; ++x) grid.density[index++] = static_cast<float>(y);
  // From the first cells' centres to the last ones': the mean is 2.5 kg/m3.
  const double depth = depth_through({&grid}, Vec3(0, 0.0225, 0), Vec3(0, 0.0475, 0));
  EXPECT_NEAR(depth, kExtinction * 2.5 * 0.025, 1e-6 * depth);
}

TEST(Sight, MeanTransmittanceOfAnEvenViewIsThatOfTheAxis) {
  const SmokyCavity clear{{}, 0.0, {}};
  EXPECT_EQ(mean_transmittance(clear, Vec3::Zero(), Vec3(0, 0.1, 0), 5e-3), 1.0);
  const SmokyCavity hazy{{}, 1e-3, {}};
  EXPECT_NEAR(mean_transmittance(hazy, Vec3::Zero(), Vec3(0, 0.1, 0), 5e-3),
              std::exp(-kExtinction * 1e-3 * 0.1), 1e-3);
  EXPECT_EQ(mean_transmittance(hazy, Vec3::Zero(), Vec3::Zero(), 5e-3), 1.0)
      << "at the lens itself nothing is in between";
  const SmokeGrid grid = slab(kDensity);
  const std::array<const SmokeGrid*, 1> grids = {&grid};
  EXPECT_NEAR(mean_transmittance({grids, 0.0, {}}, Vec3(0, -0.1, 0), Vec3(0, 0.1, 0), 2e-3),
              std::exp(-kExtinction * kDensity * 0.03), 1e-4);
}

TEST(Sight, SmokeThatHidesHalfOfTheTipLetsHalfThrough) {
  SmokeGrid grid = slab(0.0f);
  std::size_t index = 0;
  for (int z = 0; z < 20; ++z)
    for (int y = 0; y < 6; ++y)
      for (int x = 0; x < 20; ++x) grid.density[index++] = x < 10 ? 1.0f : 0.0f;  // depth 120
  const std::array<const SmokeGrid*, 1> grids = {&grid};
  const double seen =
      mean_transmittance({grids, 0.0, {}}, Vec3(0, -1.0, 0), Vec3(0, 0.06, 0), 40e-3);
  EXPECT_NEAR(seen, 0.5, 0.06);
}

}  // namespace
}  // namespace viscera
