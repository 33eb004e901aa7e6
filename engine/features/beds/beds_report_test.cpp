#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "engine/features/beds/beds.h"
#include "tests/support/lifted_block.h"
#include "tests/support/small_world.h"

namespace viscera::test {
namespace {

TEST(BedsReport, CountsWhatHoldsAndWhatPartedByForceAndByHeat) {
  auto world = build(lifted_block({}));
  ASSERT_TRUE(world);
  const double area = bed_figures(*world)[0].area;
  EXPECT_NEAR(area, 4e-4, 0.1e-4);
  BondStates& bonds = world->all<BedState>()[0].bonds;
  bonds.parted_by[0] = bonds.parted_by[1] = 1;
  bonds.opened[2] = 1.0;
  world->all<BedState>()[0].greatest_force = 0.25;
  const BedFigures figures = bed_figures(*world)[0];
  EXPECT_EQ(figures.by_heat, 2u);
  EXPECT_EQ(figures.by_force, 1u);
  EXPECT_EQ(figures.whole + 3, figures.bonds);
  const auto told = nlohmann::json::parse(beds_report(*world)[0].json)[0];
  EXPECT_EQ(told["name"], "bed");
  EXPECT_EQ(told["between"], (nlohmann::json{"block", "floor"}));
  EXPECT_EQ(told["bonds"], figures.bonds);
  EXPECT_EQ(told["bonds_broken"]["force"], 1);
  EXPECT_EQ(told["bonds_broken"]["heat"], 2);
  const double one = world->all<Bed>()[0].places.layer.areas[2];
  EXPECT_DOUBLE_EQ(told["work_J"].get<double>(), kLiftedBed.toughness * one);
  EXPECT_GT(told["parted_m2"].get<double>(), 2.0 * one);
  EXPECT_EQ(told["greatest_force_N"], 0.25);
}

TEST(BedsReport, IsLeftOutWhereThereIsNoBed) {
  auto scene = lifted_block({});
  scene.extras.remove<BedDescriptions>();
  auto world = build(scene);
  ASSERT_TRUE(world);
  EXPECT_TRUE(beds_report(*world).empty());
}

}  // namespace
}  // namespace viscera::test
