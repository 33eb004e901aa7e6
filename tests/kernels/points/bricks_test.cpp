#include "kernels/points/bricks.h"

#include <gtest/gtest.h>

#include <limits>

namespace viscera {
namespace {

TEST(BrickField, IsZeroAndEmptyUntilSomethingIsPutIn) {
  const BrickField field(0.5e-3);
  EXPECT_EQ(field.brick_count(), 0u);
  EXPECT_EQ(field.find({0, 0, 0}), -1);
  EXPECT_EQ(field.at({-3, 5, 100}), 0.0f);
  EXPECT_EQ(field.sample({0.01, -0.2, 3.0}), 0.0);
}

TEST(BrickField, NegativeVoxelsBelongToTheBrickBelow) {
  EXPECT_EQ(BrickField::brick_of({-1, -8, -9}), BrickField::Index(-1, -1, -2));
  EXPECT_EQ(BrickField::brick_of({0, 7, 8}), BrickField::Index(0, 0, 1));
  const BrickField field(0.5e-3);
  EXPECT_EQ(field.voxel_of({-0.1e-3, 0.1e-3, 0.5e-3}), BrickField::Index(-1, 0, 1));
}

TEST(BrickField, KeepsBricksInOrderOfAllocationWithDistinctKeys) {
  BrickField field;
  std::size_t expected = 0;
  for (int z = -3; z < 3; ++z) {
    for (int y = -3; y < 3; ++y) {
      for (int x = -3; x < 3; ++x) {
        EXPECT_EQ(field.ensure({x, y, z}), expected);
        EXPECT_EQ(field.brick_indices()[expected], BrickField::Index(x, y, z));
        ++expected;
      }
    }
  }
  EXPECT_EQ(field.ensure({-3, -3, -3}), 0u);
  EXPECT_EQ(field.brick_count(), expected);
  EXPECT_GE(field.memory_bytes(), expected * sizeof(BrickField::Values));
}

TEST(BrickField, SamplesALinearFieldExactlyAcrossBrickBorders) {
  BrickField field(1e-3);
  const Vec3 slope(100.0, -50.0, 25.0);
  for (int z = -1; z <= 1; ++z) {
    for (int y = -1; y <= 1; ++y) {
      for (int x = -1; x <= 1; ++x) {
        const BrickField::Index brick(x, y, z);
        BrickField::Values& values = field.brick(field.ensure(brick));
        for (int i = 0; i < BrickField::kVoxels; ++i) {
          const BrickField::Index voxel =
              brick * BrickField::kEdge + BrickField::Index(i % 8, i / 8 % 8, i / 64);
          values[i] = static_cast<float>(1.0 + slope.dot(field.centre(voxel)));
        }
      }
    }
  }
  for (const Vec3& p :
       {Vec3(0.0, 0.0, 0.0), Vec3(-2.3e-3, 7.9e-3, 0.2e-3), Vec3(4.4e-3, -6.1e-3, -0.05e-3)}) {
    EXPECT_NEAR(field.sample(p), 1.0 + slope.dot(p), 1e-6);
  }
}

TEST(BrickField, GoesOnFromItsStateAndRefusesOnesThatCannotBe) {
  BrickField field;
  field.brick(field.ensure({3, -1, 2}))[7] = 0.5f;
  field.brick(field.ensure({-4, 0, 0}))[0] = 0.25f;
  BrickField other;
  other.ensure({9, 9, 9});
  other.restore(field.state());
  EXPECT_EQ(other.find({3, -1, 2}), 0);
  EXPECT_EQ(other.find({-4, 0, 0}), 1);
  EXPECT_EQ(other.find({9, 9, 9}), -1);
  EXPECT_EQ(other.brick(0)[7], 0.5f);
  EXPECT_TRUE(BrickField::fits(field.state()));

  BrickField::State twice = field.state();
  twice.indices[1] = twice.indices[0];
  BrickField::State fewer = field.state();
  fewer.values.pop_back();
  BrickField::State far = field.state();
  far.indices[0].x() = 1 << 20;
  BrickField::State broken = field.state();
  broken.values[0][0] = std::numeric_limits<float>::quiet_NaN();
  for (const BrickField::State& wrong : {twice, fewer, far, broken})
    EXPECT_FALSE(BrickField::fits(wrong));
}

}  // namespace
}  // namespace viscera
