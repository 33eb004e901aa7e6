#include "kernels/parting/tissue_share.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "kernels/parting/blade_sweep.h"

namespace viscera {
namespace {

constexpr double kShareVoxel = 0.5e-3;

TEST(TissueShare, IsWholeWhereNothingWasTaken) {
  const TissueShare tissue(kShareVoxel);
  EXPECT_TRUE(tissue.untouched());
  EXPECT_EQ(tissue.share(Vec3(1e-3, 2e-3, -3e-3)), 1.0);
  EXPECT_TRUE(tissue.bricks().empty());
}

TEST(TissueShare, IsHalfOnTheSphereOfABallThatIsGone) {
  TissueShare tissue(kShareVoxel);
  const Vec3 centre(-1e-3, 2.2e-3, 0.7e-3);
  const double radius = 4e-3;
  const auto ball = [&](const Vec3& x) { return (x - centre).norm() - radius; };
  const Vec3 half = Vec3::Constant(radius);
  EXPECT_TRUE(tissue.take_out(Box(centre - half, centre + half), ball));
  EXPECT_FALSE(tissue.take_out(Box(centre - half, centre + half), ball)) << "it is gone already";
  for (const Vec3& way : {Vec3(1, 0, 0), Vec3(0.6, 0, 0.8), Vec3(-0.48, 0.6, 0.64)})
    EXPECT_NEAR(tissue.share(Vec3(centre + radius * way)), 0.5, 0.02);
  EXPECT_EQ(tissue.share(centre), 0.0);
  EXPECT_EQ(tissue.share(Vec3(centre + Vec3(0, 0, 6e-3))), 1.0);
}

TEST(TissueShare, OnlyEverFalls) {
  TissueShare tissue(kShareVoxel);
  EXPECT_TRUE(tissue.limit({-9, 0, 3}, 0.3));
  EXPECT_FALSE(tissue.limit({-9, 0, 3}, 0.7));
  EXPECT_EQ(tissue.share(TissueShare::Voxel{-9, 0, 3}), static_cast<double>(0.3f));
  EXPECT_EQ(tissue.share(TissueShare::Voxel{-8, 0, 3}), 1.0);
  EXPECT_FALSE(tissue.limit({500, 0, 0}, 1.0));
  EXPECT_EQ(tissue.bricks(), (std::vector<TissueShare::Voxel>{TissueShare::Voxel(-16, 0, 0)}));
}

TEST(TissueShare, ABladesWayIsOutAsWideAsTheBladeOrTheLeastKerf) {
  for (const double thickness : {0.1e-3, 2e-3}) {
    TissueShare tissue(kShareVoxel);
    const BladeSweep blade{{Vec3(-10e-3, 0, 0), Vec3(10e-3, 0, 0)},
                           {Vec3(-10e-3, 0, -8e-3), Vec3(10e-3, 0, -8e-3)},
                           thickness};
    EXPECT_TRUE(sweep(blade, tissue));
    const double half = 0.5 * std::max(thickness, tissue.least_kerf());
    for (double z = -7.5e-3; z < 0.0; z += 0.37e-3)
      EXPECT_LT(tissue.share(Vec3(1.3e-3, 0.0, z)), 0.5) << "it is through";
    for (const double side : {-1.0, 1.0}) {
      EXPECT_LT(tissue.share(Vec3(1.3e-3, side * (half - 0.1 * kShareVoxel), -4e-3)), 0.5);
      EXPECT_GT(tissue.share(Vec3(1.3e-3, side * (half + 0.1 * kShareVoxel), -4e-3)), 0.5);
    }
  }
}

TEST(TissueShare, APlateTakesWhatItSaysOverItsArea) {
  for (const double thickness : {0.5e-3, 0.9e-3, 3e-3}) {
    TissueShare tissue(0.25e-3);
    constexpr double kAcross = 12e-3;
    // So large that its rim is little, which takes a half of a round plate's more.
    const Box reach(Vec3(-kAcross, -kAcross, -0.5 * thickness),
                    Vec3(kAcross, kAcross, 0.5 * thickness));
    const double taken =
        tissue.take_out(reach, [&](const Vec3& x) { return std::abs(x.z()) - 0.5 * thickness; });
    const double voxels = 2.0 * 2.25 * 0.25e-3;  // that it is asked beyond its reach, about
    const double across = 2.0 * kAcross + voxels;
    const double expected = tissue.taken_by_plate(thickness);
    EXPECT_NEAR(taken / (across * across), expected, 0.03 * expected) << thickness;
    EXPECT_GE(expected, thickness);
    EXPECT_LT(expected, thickness + 0.1e-3);
  }
}

TEST(TissueShare, TakesNoStateWhoseSharesAreNone) {
  TissueShare tissue(0.25e-3);
  tissue.limit({1, 2, 3}, 0.25);
  TissueShare other(0.25e-3);
  other.restore(tissue.state());
  EXPECT_EQ(other.share(TissueShare::Voxel(1, 2, 3)), 0.25);
  TissueShare::State wrong = tissue.state();
  wrong.values[0][0] = 1.5f;
  EXPECT_TRUE(TissueShare::fits(tissue.state()));
  EXPECT_FALSE(TissueShare::fits(wrong));
}

}  // namespace
}  // namespace viscera
