// Scissors with current, which close in a block that its left end holds.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "engine/features/cautery/cautery.h"
#include "engine/features/parting/blades_in_tissue.h"
#include "engine/features/parting/parting.h"
#include "engine/simulator/build.h"
#include "tests/support/small_world.h"

namespace viscera::test {
namespace {

constexpr double kBlockTop = 8e-3;                   // [m]
constexpr double kShears = 14e-3, kShearsIn = 4e-3;  // blades; so far in the block at last [m]
constexpr double kShearsThick = 0.8e-3;              // [m]
constexpr double kShut = 0.7, kCurrentEnds = 1.5;    // [s]

/// From above into the block, open; there they close, along y. Current `cutting` [W] flows from
/// then on; `before` flows while they are in the air.
SceneDescription block_to_shear(double cutting, double before = 0.0) {
  SceneDescription scene =
      held_bar_scene({36e-3, 16e-3, 2.0 * kBlockTop}, 2e-3, 0.1e-3, 4.2e-3, 4.2e-3);
  scene.organs[0].response = Response::kFinite;
  scene.organs[0].extras.set(CuttableDescription{0.4e-3});
  const Vec3 over(0, 0, kBlockTop + 4e-3), in(0, 0, kBlockTop - kShearsIn);
  InstrumentDescription scissors = straight_tool("scissors", InstrumentKind::kScissors, 0.5e-3,
                                                 {{0.0, over, before, 0.0},
                                                  {0.2, over, 0.0, 1.0},
                                                  {0.4, in, 0.0, 1.0},
                                                  {0.5, in, cutting, 1.0},
                                                  {kShut, in, cutting, 0.0},
                                                  {kCurrentEnds, in, 0.0, 0.0}});
  scissors.trocar = Vec3(0, 0, 20.0);
  scissors.roll = std::numbers::pi / 2.0;
  scissors.extras.set(BladeDescription{kShears, kShearsThick});
  scene.instruments = {scissors};
  return scene;
}

TEST(LiveScissors, CoagulateBesideTheirCutAndTheBookCloses) {
  const auto world = build(block_to_shear(40.0));
  ASSERT_TRUE(world);
  FlagSet flags = step_until(*world, kShut + 0.1);
  const auto blades = blades_in_tissue(*world, world->model().instruments()[0]);
  ASSERT_TRUE(blades);
  // Both blades lie on each other in the block, upright.
  const double area = 2.0 * kShearsThick * kShearsIn;
  EXPECT_NEAR(blades->area, area, 0.2 * area);
  EXPECT_NEAR((blades->middle - Vec3(0, 0, kBlockTop - 0.5 * kShearsIn)).norm(), 0.0, 0.7e-3)
      << blades->middle.transpose();
  EXPECT_FALSE(world->all<InstrumentContact>()[0].touching) << "they don't press what they cut";
  EXPECT_FALSE(world->all<BurnTrace>()[0].current.open);
  EXPECT_NEAR(world->all<BurnTrace>()[0].current.radius, std::sqrt(blades->area / std::numbers::pi),
              1e-6);
  flags.raise(step_until(*world, kCurrentEnds));
  EXPECT_FALSE(flags.has(kNotHeated));
  const HeatBricks& bricks = world->all<OrganBurn>()[0].heat.bricks();
  // Beside both faces of the blades, and over the depth that they stand in.
  for (const double side : {-0.7e-3, 0.7e-3})
    for (const double deep : {0.3, 0.5, 0.7})
      EXPECT_GT(bricks.coagulation_at(bricks.voxel_of(Vec3(side, 0, kBlockTop - deep * kShearsIn))),
                1.0)
          << side << " " << deep;
  EXPECT_LT(bricks.coagulation_at(bricks.voxel_of(Vec3(10e-3, 0, 0))), 0.01) << "far away";
  step_until(*world, 2.6);
  EXPECT_GE(world->all<OrganCut>()[0].bodies, 1u);
  const CauteryFigures figures = *cautery_figures(*world);
  EXPECT_GT(figures.delivered, 5.0);
  EXPECT_GT(figures.body, 0.0);
  EXPECT_NEAR(figures.generated, figures.delivered + figures.body + figures.metal + figures.gas,
              1e-4 * figures.generated);
  EXPECT_LT(std::abs(figures.residual), 1e-3);
}

TEST(LiveScissors, WithoutCurrentNothingIsWarmAndInTheAirItIsOpen) {
  const auto world = build(block_to_shear(0.0, 40.0));
  ASSERT_TRUE(world);
  step_until(*world, 0.1);
  ASSERT_EQ(world->all<BurnTrace>().size(), 1u);
  EXPECT_TRUE(world->all<BurnTrace>()[0].current.open);
  step_until(*world, kShut + 0.1);
  EXPECT_GT(world->all<OrganCut>()[0].area, 0.0);
  ASSERT_EQ(world->all<OrganBurn>().size(), 1u);
  EXPECT_EQ(world->all<OrganBurn>()[0].heat.book().delivered, 0.0);
  EXPECT_EQ(world->all<OrganBurn>()[0].heat.greatest_excess(), 0.0);
}

}  // namespace
}  // namespace viscera::test
