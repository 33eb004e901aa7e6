// Instruments that cross each other.
#include "engine/features/shafts/press_tools.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "engine/features/contact/contact.h"
#include "engine/features/shafts/shafts.h"
#include "engine/features/shafts/tubes.h"
#include "tests/support/same_runs.h"
#include "tests/support/small_world.h"

namespace viscera::test {
namespace {

constexpr double kRadius = 2.5e-3;  // [m]
constexpr double kHigh = 80e-3;     // above the organ [m]

/// Lies along x, still, its tip at the left.
InstrumentDescription still_tool() {
  InstrumentDescription tool = straight_tool("still", InstrumentKind::kProbe, kRadius,
                                             {{0.0, Vec3(-60e-3, 0, kHigh), 0.0, 1.0}});
  tool.shaft_radius = kRadius;
  tool.trocar = Vec3(140e-3, 0, kHigh);
  return tool;
}

/// Lies along y, and comes down on the other one's middle from above, within `takes`, until its
/// axis is `deep` below the place where both touch.
InstrumentDescription coming_tool(double deep, double takes = 0.5) {
  const double trocar = 200e-3;
  const double from = kHigh + 2.0 * kRadius + 3e-3, to = kHigh + 2.0 * kRadius - deep;
  InstrumentDescription tool = straight_tool(
      "coming", InstrumentKind::kProbe, kRadius,
      {{0.0, Vec3(0, -50e-3, from), 0.0, 1.0}, {takes, Vec3(0, -50e-3, to), 0.0, 1.0}});
  tool.shaft_radius = kRadius;
  // Far off and as high as it goes: it hardly turns.
  tool.trocar = Vec3(0, trocar, to);
  return tool;
}

SceneDescription tools_scene(std::vector<InstrumentDescription> tools) {
  SceneDescription scene = held_bar_scene(Vec3(20e-3, 20e-3, 10e-3), 3e-3, 1e-3, 6e-3, 6e-3);
  scene.instruments = std::move(tools);
  scene.extras.set(ShaftsDescription{.tools = true});
  return scene;
}

TEST(PressTools, ThatComeOnEachOtherPushBothAwayByWhatTheyBend) {
  constexpr double kDeep = 0.4e-3;
  const auto world = build(tools_scene({still_tool(), coming_tool(kDeep)}));
  ASSERT_TRUE(world);
  step_until(*world, 0.02);
  EXPECT_EQ(world->all<ShaftState>()[0].load.force, Vec3(Vec3::Zero()));
  EXPECT_EQ(step_until(*world, 1.0), FlagSet());
  const ShaftState &below = world->all<ShaftState>()[0], &above = world->all<ShaftState>()[1];
  const Tube still{Vec3(-60e-3, 0, kHigh), Vec3(140e-3, 0, kHigh), kRadius};
  const Tube coming{Vec3(0, -50e-3, 0), Vec3(0, 200e-3, 0), kRadius};
  const double a = bending_stiffness(still, Vec3(0, 0, kHigh)),
               b = bending_stiffness(coming, Vec3::Zero());
  EXPECT_NEAR(above.load.force.z(), kDeep * a * b / (a + b), 1e-3 * above.load.force.z());
  EXPECT_GT(above.load.force.z(), 0.1);
  EXPECT_EQ(above.load.force, Vec3(-below.load.force));
  // The hand at the tip has a longer arm than the place that is pushed.
  const Vec3 felt = world->all<InstrumentContact>()[0].force;
  EXPECT_NEAR(felt.z(), below.load.force.z() * 140.0 / 200.0, 1e-6);
  EXPECT_NEAR(below.greatest.crossed, kDeep, 1e-6);
}

TEST(PressTools, KeepTheirSideHoweverFastTheyCome) {
  // Through the other in two frames.
  const auto world = build(tools_scene({still_tool(), coming_tool(14e-3, 0.034)}));
  ASSERT_TRUE(world);
  const FlagSet flags = step_until(*world, 0.5);
  EXPECT_TRUE(flags.has(kToolsCross));
  EXPECT_GT(world->all<ShaftState>()[1].load.force.z(), 5.0) << "it is pushed back up";
}

TEST(PressTools, ATipMeetsTheSideOfAnother) {
  InstrumentDescription poking =
      straight_tool("poking", InstrumentKind::kProbe, kRadius,
                    {{0.0, Vec3(10e-3, 0, kHigh + 20e-3), 0.0, 1.0},
                     {0.5, Vec3(10e-3, 0, kHigh + 2.0 * kRadius - 0.5e-3), 0.0, 1.0}});
  poking.shaft_radius = kRadius;
  poking.trocar = Vec3(10e-3, 0, kHigh + 200e-3);
  const auto world = build(tools_scene({still_tool(), poking}));
  ASSERT_TRUE(world);
  EXPECT_EQ(step_until(*world, 1.0), FlagSet());
  EXPECT_GT(world->all<InstrumentContact>()[1].force.z(), 0.1);
  EXPECT_LT(world->all<InstrumentContact>()[0].force.z(), -0.1);
}

TEST(PressTools, AreTold) {
  const auto world = build(tools_scene({still_tool(), coming_tool(0.4e-3)}));
  ASSERT_TRUE(world);
  step_until(*world, 1.0);
  const auto report = shafts_report(*world);
  ASSERT_EQ(report.size(), 1u);
  const Json first = Json::parse(report[0].json)[0];
  EXPECT_EQ(first["tools"][0]["tool"], "coming");
  EXPECT_GT(first["tools"][0]["greatest_force_N"], 0.1);
  EXPECT_NEAR(first["greatest_overlap_with_tools_m"].get<double>(), 0.4e-3, 1e-6);
}

TEST(PressTools, PassThroughEachOtherWhereTheSceneSaysNothing) {
  SceneDescription scene = tools_scene({still_tool(), coming_tool(0.4e-3)});
  scene.extras.set(ShaftsDescription{});
  const auto world = build(scene);
  ASSERT_TRUE(world);
  EXPECT_EQ(step_until(*world, 1.0), FlagSet());
  EXPECT_EQ(world->all<InstrumentContact>()[0].force, Vec3(Vec3::Zero()));
}

TEST(PressTools, GoOnFromASavedStateToTheSameBits) {
  const auto world = build(tools_scene({still_tool(), coming_tool(14e-3, 0.034)}));
  ASSERT_TRUE(world);
  step_until(*world, 0.05);
  expect_same_from_saved(*world, 0.2);
}

}  // namespace
}  // namespace viscera::test
