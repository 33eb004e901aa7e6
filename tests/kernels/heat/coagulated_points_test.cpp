#include "kernels/heat/coagulated_points.h"

#include <gtest/gtest.h>

#include <cmath>

namespace viscera {
namespace {

constexpr double kVoxel = 0.5e-3, kPitch = 2e-3;
constexpr double kWater = 0.72;

/// Points 2 mm apart in a cube of 16 mm from the origin.
struct Points {
  std::vector<Vec3> positions;
  std::vector<double> volumes;
  Points() {
    for (int k = 0; k < 8; ++k)
      for (int j = 0; j < 8; ++j)
        for (int i = 0; i < 8; ++i) {
          positions.push_back(kPitch * Vec3(i + 0.5, j + 0.5, k + 0.5));
          volumes.push_back(std::pow(kPitch, 3));
        }
  }
  CoagulationGauge gauge() const { return {positions, volumes}; }
};

/// Coagulates what `inside` says.
template <class Inside>
HeatBricks harmed(const Inside& inside, float coagulation, float water = 1.0f) {
  HeatBricks bricks(kVoxel, {}, 1000);
  for (int k = -1; k < 5; ++k)
    for (int j = 0; j < 4; ++j)
      for (int i = 0; i < 4; ++i) {
        HeatBrick& brick = *bricks.warm_up(BrickIndex(i, j, k));
        for (int v = 0; v < BrickField::kVoxels; ++v) {
          if (!inside(bricks.centre(brick, v))) continue;
          brick.coagulation[static_cast<std::size_t>(v)] = coagulation;
          brick.collagen[static_cast<std::size_t>(v)] = coagulation / 3.0f;
          brick.water[static_cast<std::size_t>(v)] = water;
          brick.harmed = true;
        }
      }
  return bricks;
}

const auto kNowhere = [](const Vec3&) { return false; };

TEST(CoagulatedPoints, SoundTissueIsAsItWas) {
  const Points points;
  const CoagulatedPoints found = points.gauge().read(harmed(kNowhere, 0.0f), kWater);
  for (std::size_t q = 0; q < points.positions.size(); ++q) {
    EXPECT_EQ(found.stiffness[q], 1.0);
    EXPECT_EQ(found.shrinkage[q], 0.0);
  }
  EXPECT_EQ(found.stiffened, 0.0);
  EXPECT_EQ(found.left_out, 0.0);
}

TEST(CoagulatedPoints, TissueCoagulatedThroughoutHasItsFactor) {
  const Points points;
  const auto bricks = harmed([](const Vec3& x) { return x.z() > 0.0; }, 3.0f, 0.5f);
  const CoagulatedPoints found = points.gauge().read(bricks, kWater);
  // Worked out apart from the program. Coagulated by 0.7374, of the water 0.39 left to feel:
  // sevenfold by coagulation, fourfold again by drying, each by its share; shorter by 0.1286, and
  // half of the lost water's volume closed.
  for (std::size_t q = 0; q < points.positions.size(); ++q) {
    // Voxels beyond the cube are nearest to its border points, too: a mean over more of the same.
    EXPECT_NEAR(found.stiffness[q], 12.7019330, 1e-5);
    EXPECT_NEAR(found.shrinkage[q], 0.1972920, 1e-6);
  }
  EXPECT_NEAR(found.stiffened, std::pow(16e-3, 3), 1e-12);
}

/// A lesion between four points, smaller than their distance.
TEST(CoagulatedPoints, NothingFallsBetweenPoints) {
  const Points points;
  const Vec3 centre(8e-3, 8e-3, 8e-3);
  const auto bricks = harmed([&](const Vec3& x) { return (x - centre).norm() < 0.9e-3; }, 5.0f);
  const CoagulatedPoints found = points.gauge().read(bricks, kWater);
  double gain = 0.0, volume = 0.0;
  for (std::size_t q = 0; q < points.positions.size(); ++q)
    gain += points.volumes[q] * (found.stiffness[q] - 1.0);
  for (std::size_t b = 0; b < bricks.count(); ++b)
    for (const float coagulation : bricks.brick(b).coagulation)
      volume += coagulation > 0.0f ? std::pow(kVoxel, 3) : 0.0;
  ASSERT_GT(volume, 0.0);
  EXPECT_NEAR(gain, volume * 4.871133, 1e-6 * gain);  // 6 times the share, 0.8119
}

TEST(CoagulatedPoints, TissueFarFromAllPointsIsCountedAsLeftOut) {
  const Points points;
  const auto bricks = harmed([](const Vec3& x) { return x.z() > 20e-3 || x.z() < -3.5e-3; }, 5.0f);
  const CoagulatedPoints found = points.gauge().read(bricks, kWater);
  EXPECT_GT(found.left_out, 0.5e-9);
  EXPECT_EQ(found.stiffened, 0.0);
}

TEST(CoagulatedPoints, HardlyAnyDamageIsNone) {
  const Points points;
  const CoagulatedPoints found =
      points.gauge().read(harmed([](const Vec3&) { return true; }, 1.2e-3f), kWater);
  EXPECT_EQ(found.greatest_stiffness, 1.0);
}

TEST(CoagulatedPoints, ReadAgainSaysTheSame) {
  const Points points;
  const auto bricks = harmed([](const Vec3& x) { return x.norm() < 6e-3; }, 1.0f);
  CoagulationGauge gauge = points.gauge();
  const CoagulatedPoints first = gauge.read(bricks, kWater), second = gauge.read(bricks, kWater);
  EXPECT_EQ(first.stiffness, second.stiffness);
  EXPECT_EQ(first.shrinkage, second.shrinkage);
}

/// So a gauge needs no state.
TEST(CoagulatedPoints, AGaugeThatHasReadBeforeReadsWhatAFreshOneDoes) {
  const Points points;
  CoagulationGauge used = points.gauge();
  const Vec3 centre(8e-3, 8e-3, 8e-3);
  for (const double radius : {1e-3, 6e-3, 3e-3}) {
    const auto bricks = harmed([&](const Vec3& x) { return (x - centre).norm() < radius; }, 5.0f);
    const CoagulatedPoints one = used.read(bricks, kWater);
    const CoagulatedPoints other = points.gauge().read(bricks, kWater);
    EXPECT_EQ(one.stiffness, other.stiffness);
    EXPECT_EQ(one.shrinkage, other.shrinkage);
    EXPECT_EQ(one.left_out, other.left_out);
  }
}

}  // namespace
}  // namespace viscera
