#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "engine/features/gas/gas_keys.h"
#include "engine/features/smoke/smoke.h"
#include "tests/support/small_world.h"
#include "tests/support/smoking_ball.h"

namespace viscera::test {
namespace {

TEST(SmokeReport, KeepsTheBookOfAllVolumesTogether) {
  const auto world = build(smoking_ball_scene());
  ASSERT_TRUE(world);
  step_until(*world, 0.2);
  const SmokeFigures figures = smoke_figures(*world);
  EXPECT_NEAR(figures.emitted, 4e-7, 4e-8);
  EXPECT_NEAR(figures.airborne + figures.background + figures.evacuated + figures.leaked +
                  figures.deposited,
              figures.emitted, 1e-9 * figures.emitted);
  EXPECT_GT(figures.most_particles, 50u);
  const std::vector<ReportSection> sections = smoke_report(*world);
  ASSERT_EQ(sections.size(), 1u);
  EXPECT_EQ(sections[0].key, "smoke");
  const Json expected = {{"particles_max", figures.most_particles},
                         {"volumes", 0},
                         {"writing_s", 0.0},
                         {"emitted_kg", figures.emitted},
                         {"airborne_kg", figures.airborne},
                         {"background_kg", figures.background},
                         {"evacuated_kg", figures.evacuated},
                         {"leaked_kg", figures.leaked},
                         {"deposited_kg", figures.deposited},
                         {"time_in_smoke", nullptr},
                         {"view_least", nullptr},
                         {"view_at_end", nullptr}};
  EXPECT_EQ(Json::parse(sections[0].json), expected);
  EXPECT_TRUE(smoke_warnings(*world).empty());
}

TEST(SmokeReport, SaysWhyThereIsNoSmoke) {
  SceneDescription scene = smoking_ball_scene();
  EXPECT_TRUE(anything_smokes(scene));
  EXPECT_TRUE(smoke_skipped(scene).empty());
  scene.extras.find<SmokeDescriptions>()->front().emitters.clear();  // and no hook burns
  EXPECT_FALSE(anything_smokes(scene));
  ASSERT_EQ(smoke_skipped(scene).size(), 1u);
  EXPECT_EQ(smoke_skipped(scene)[0].why, "nothing burns: no hook carries current");
  scene.extras.remove<SmokeDescriptions>();
  EXPECT_EQ(smoke_skipped(scene)[0].why, "the scene has no smoke volume");
}

}  // namespace
}  // namespace viscera::test
