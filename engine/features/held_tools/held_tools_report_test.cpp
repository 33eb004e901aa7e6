#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "engine/features/held_tools/held_tools.h"
#include "tests/support/small_world.h"

namespace viscera::test {
namespace {

constexpr double kTop = 25e-3;  // pole of the ball [m]
constexpr double kTip = 4e-3;

/// A hand that presses the ball's pole.
SceneDescription held_probe() {
  SceneDescription scene = soft_ball_scene(6e-3, 3e-3);
  InstrumentDescription probe = straight_tool("probe", InstrumentKind::kProbe, kTip,
                                              {{0.0, Vec3(0, 0, kTop + kTip + 5e-3), 0.0, 1.0},
                                               {0.3, Vec3(0, 0, kTop + kTip - 2e-3), 0.0, 1.0}});
  probe.extras.set(HapticDescription());
  scene.instruments = {probe};
  return scene;
}

TEST(HeldToolsReport, TellsWhatAHandFelt) {
  const auto world = build(held_probe());
  ASSERT_TRUE(world);
  ASSERT_TRUE(hold_tools(*world, {}));
  step_until(*world, 0.4);
  const std::vector<HapticFigures> figures = haptic_figures(*world);
  ASSERT_EQ(figures.size(), 1u);
  EXPECT_EQ(figures[0].tool, "probe");
  EXPECT_NEAR(static_cast<double>(figures[0].ticks), 400.0, 17.0);
  EXPECT_GT(figures[0].greatest_force, 0.0);
  EXPECT_GT(figures[0].tissue.hives, 0u);
  const std::vector<ReportSection> sections = held_tools_report(*world);
  ASSERT_EQ(sections.size(), 1u);
  EXPECT_EQ(sections[0].key, "haptics");
  const Json tool = Json::parse(sections[0].json)[0];
  EXPECT_EQ(tool["tool"], "probe");
  EXPECT_EQ(tool["device"], "simulated");
  EXPECT_EQ(tool["ticks"], figures[0].ticks);
  EXPECT_EQ(tool["greatest_force_N"], figures[0].greatest_force);
  EXPECT_EQ(tool["energy_J"], figures[0].energy);
  EXPECT_EQ(tool["hives"]["built"], figures[0].tissue.hives);
  EXPECT_EQ(tool["events"], figures[0].events);
  for (const char* key : {"newton_steps", "tangent_answers", "deadline_misses", "linear_answers"})
    EXPECT_TRUE(tool["beyond_linear"].contains(key)) << key;
}

TEST(HeldToolsReport, ASceneThatNobodyHoldsSaysThatHapticsWereSkipped) {
  SceneDescription scene = held_probe();
  EXPECT_TRUE(held_tools_skipped(scene).empty());
  scene.instruments[0].extras.remove<HapticDescription>();
  ASSERT_EQ(held_tools_skipped(scene).size(), 1u);
  EXPECT_EQ(held_tools_skipped(scene)[0].what, "haptics");
  const auto world = build(scene);
  ASSERT_TRUE(world);
  EXPECT_EQ(held_tools_report(*world).front().json, "[]");
}

}  // namespace
}  // namespace viscera::test
