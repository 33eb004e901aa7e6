#include "engine/verification/bent_block.h"

#include <gtest/gtest.h>

#include <cmath>

namespace viscera {
namespace {

TEST(BentBlock, MovedByLittleHasTheForceOfABeamWithShear) {
  // Both ends clamped and kept flat: 12 E I / L^3 and, of shear, 5/6 G A / L in series.
  const double thick = 10e-3, length = 80e-3, moved = 1e-5;
  BentBlockOptions options;
  options.size = Vec3(length, thick, thick);
  options.moved = Vec3(0.0, 0.0, moved);
  options.material = {12e3, 0.0};  // ends that keep their shape hold nothing else
  options.steps = 1;
  const auto block = BentBlock::solve(options);
  ASSERT_TRUE(block) << block.error().text();
  const double bending = 12.0 * 12e3 * std::pow(thick, 4) / 12.0 / std::pow(length, 3),
               shear = 5.0 / 6.0 * 6e3 * thick * thick / length;
  const double beam = moved / (1.0 / bending + 1.0 / shear);
  EXPECT_NEAR(block->force().z(), beam, 0.02 * beam);
  EXPECT_NEAR(block->at(Vec3(0.0, 2e-3, 1e-3)).z(), 0.5 * moved, 0.01 * moved);
}

TEST(BentBlock, ItsMovedEndIsWhereItWasMovedToAndItsHeldOneIsNot) {
  BentBlockOptions options;
  options.elements = 8;
  const auto block = BentBlock::solve(options);
  ASSERT_TRUE(block) << block.error().text();
  for (const double y : {-10e-3, 0.0, 7e-3})
    for (const double z : {-10e-3, 3e-3}) {
      EXPECT_LT((block->at(Vec3(40e-3, y, z)) - options.moved).norm(), 1e-9);
      EXPECT_LT(block->at(Vec3(-40e-3, y, z)).norm(), 1e-9);
    }
  // The other half mirrors this one.
  const Vec3 here = block->at(Vec3(5e-3, 6e-3, 2e-3)), there = block->at(Vec3(5e-3, -6e-3, 2e-3));
  EXPECT_LT((here - Vec3(there.x(), -there.y(), there.z())).norm(), 1e-12);
  EXPECT_GT(block->force().x(), 0.3 * block->force().z()) << "it is drawn out, too";
}

TEST(BentBlock, HasConverged) {
  BentBlockOptions options;
  options.elements = 12;
  const auto coarse = BentBlock::solve(options);
  options.elements = 16;
  const auto fine = BentBlock::solve(options);
  ASSERT_TRUE(coarse && fine);
  EXPECT_LT((coarse->force() - fine->force()).norm(), 2e-3 * fine->force().norm());
}

}  // namespace
}  // namespace viscera
