// The field about a disc against its closed form.
#include "kernels/heat/disc_field.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace viscera {
namespace {

constexpr double kPi = std::numbers::pi;

/// Sums over the half-space below z = 0, a plane between voxels.
std::vector<double> sums_of(const DiscField& disc, double reach, double voxel) {
  std::vector<double> sums(static_cast<std::size_t>(disc.shells()), 0.0);
  const int most = static_cast<int>(std::ceil(reach / voxel / 8.0)) * 8;
  std::array<DiscField::Shares, 8> shares;
  for (int z = -most; z < 0; ++z)
    for (int y = -most; y < most; ++y)
      for (int x = -most; x < most; x += 8) {
        if (!disc.share_row((Vec3(x, y, z).array() + 0.5) * voxel, shares)) continue;
        for (const DiscField::Shares& one : shares)
          for (std::size_t s = 0; s < sums.size(); ++s) sums[s] += static_cast<double>(one[s]);
      }
  return sums;
}

TEST(DiscField, EveryShellOfAHalfSpaceHasTheSameWhole) {
  for (const double radius : {0.4e-3, 1e-3, 2e-3}) {
    const double reach = 6.0 * radius, voxel = 0.25e-3;
    const DiscField disc(Vec3(0.03e-3, 0.07e-3, 0.0), Vec3::UnitZ(), radius, reach, voxel);
    const double exact = 2.0 * kPi * radius * disc.shell();
    const std::vector<double> sums = sums_of(disc, reach, voxel);
    double whole = 0.0;
    for (const double sum : sums) whole += sum;
    // Samples miss the rim, where the field of the innermost shell has its greatest part.
    EXPECT_GT(sums[0], 0.65 * exact) << radius;
    EXPECT_LT(sums[0], exact) << radius;
    for (std::size_t s = 1; s < sums.size(); ++s) EXPECT_NEAR(sums[s], exact, 0.05 * exact) << s;
    EXPECT_NEAR(whole, 2.0 * kPi * radius * disc.last(), 0.04 * whole) << radius;
  }
}

TEST(DiscField, FarAwayAVoxelHasAPointsShare) {
  const double radius = 0.5e-3, voxel = 0.5e-3;
  const DiscField disc(Vec3::Zero(), Vec3::UnitZ(), radius, 5e-3, voxel);
  std::array<DiscField::Shares, 8> shares;
  ASSERT_TRUE(disc.share_row(Vec3(0.25e-3, 0.25e-3, -3.75e-3), shares));
  double sum = 0.0;
  for (const float share : shares[0]) sum += static_cast<double>(share);
  const double away = Vec3(0.25e-3, 0.25e-3, 3.75e-3).norm();
  // u nears pi/2 - radius / distance.
  const double exact = radius * radius / std::pow(away, 4) * std::pow(voxel, 3);
  EXPECT_NEAR(sum, exact, 0.04 * exact);
}

TEST(DiscField, BeyondItsReachThereIsNothing) {
  const DiscField disc(Vec3::Zero(), Vec3::UnitZ(), 1e-3, 6e-3, 0.5e-3);
  std::array<DiscField::Shares, 8> shares;
  EXPECT_FALSE(disc.share_row(Vec3(0.25e-3, 7e-3, -1e-3), shares));
  EXPECT_FALSE(disc.share_row(Vec3(6.5e-3, 0.0, -1e-3), shares));
  EXPECT_FALSE(disc.share_row(Vec3(-11e-3, 0.0, -1e-3), shares));
  ASSERT_TRUE(disc.share_row(Vec3(4.25e-3, 0.0, -1e-3), shares));
  for (const float share : shares[7]) EXPECT_EQ(share, 0.0f);
}

}  // namespace
}  // namespace viscera
