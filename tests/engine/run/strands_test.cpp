#include "engine/run/strands.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "engine/run/view.h"
#include "tests/support/lifted_block.h"
#include "tests/support/small_world.h"

namespace viscera::test {
namespace {

/// Of the first bed.
std::vector<StrandHalf> strands_of(const World& world) {
  return strand_halves(world, world.all<Bed>().owner(0));
}

TEST(Strands, HalvesOfWhatHoldsMeetHalfWayBetweenTheOrgans) {
  auto world = build(lifted_block({}));
  ASSERT_TRUE(world);
  step_until(*world, 0.3);
  const std::vector<StrandHalf> halves = strands_of(*world);
  const std::size_t bonds = world->all<BedState>()[0].bonds.opened.size();
  ASSERT_EQ(halves.size() % (2 * bonds), 0u) << "as many fibres for every bond";
  ASSERT_GT(halves.size(), 0u);
  for (std::size_t h = 0; h < halves.size(); h += 2) {
    const Vec3f one = halves[h].foot + halves[h].reach,
                other = halves[h + 1].foot + halves[h + 1].reach;
    EXPECT_LT((one - other).norm(), 1e-6f);
    EXPECT_FLOAT_EQ(halves[h].end_radius, halves[h + 1].end_radius);
    EXPECT_LE(halves[h].end_radius, halves[h].foot_radius);
    EXPECT_TRUE(halves[h].bend.isZero());
  }
}

TEST(Strands, ThinAsTheyAreDrawnOut) {
  auto world = build(lifted_block({}));
  ASSERT_TRUE(world);
  const std::vector<StrandHalf> before = strands_of(*world);
  step_until(*world, 0.55);
  const std::vector<StrandHalf> drawn = strands_of(*world);
  ASSERT_GT(bed_figures(*world)[0].whole, 0u);
  ASSERT_GT(world->all<BedState>()[0].bonds.opened[0], 1.2e-3);
  for (std::size_t h = 0; h < drawn.size(); ++h) {
    if (!drawn[h].bend.isZero()) continue;  // parted by now
    EXPECT_GT(drawn[h].reach.norm(), before[h].reach.norm());
    EXPECT_LE(drawn[h].end_radius, before[h].end_radius);
  }
  const auto thickness = [](const std::vector<StrandHalf>& halves) {
    float sum = 0.0f;
    for (const StrandHalf& half : halves) sum += half.end_radius;
    return sum;
  };
  EXPECT_LT(thickness(drawn), 0.95f * thickness(before));
}

TEST(Strands, WhatPartedLeavesShortStumpsOnBothOrgansCharredWhereHeatDidIt) {
  auto world = build(lifted_block({}));
  ASSERT_TRUE(world);
  BondStates& bonds = world->all<BedState>()[0].bonds;
  bonds.parted_by[0] = 1;
  bonds.opened[1] = 1.0;
  const std::vector<StrandHalf> halves = strands_of(*world);
  const std::size_t each = halves.size() / bonds.opened.size();
  for (std::size_t h = 0; h < 2 * each; ++h) {
    EXPECT_FALSE(halves[h].bend.isZero());
    EXPECT_GT(halves[h].reach.norm(), 0.0f);
    EXPECT_LT(halves[h].reach.norm(), 0.5 * kLiftedBed.last());
    EXPECT_EQ(halves[h].charred, h < each ? 1.0f : 0.0f);
  }
  EXPECT_TRUE(halves[2 * each].bend.isZero()) << "the third bond holds";
}

TEST(Strands, AreInTheViewUnderTheNameOfTheirBed) {
  auto scene = lifted_block({});
  scene.camera.emplace();
  scene.camera->path.emplace_back();
  scene.camera->path[0].tip = Vec3(0, -0.1, 0);
  auto world = build(scene);
  ASSERT_TRUE(world);
  Shown shown;
  const FrameView view = make_view(*world, shown, scene, Endoscope(*scene.camera), 0);
  ASSERT_EQ(view.beds.size(), 1u);
  EXPECT_EQ(view.beds[0].name, "bed");
  EXPECT_EQ(view.beds[0].halves.size(), strands_of(*world).size());
}

}  // namespace
}  // namespace viscera::test
