#include "engine/run/observers/sight.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "engine/features/smoke/smoke_keys.h"
#include "engine/simulator/build.h"
#include "tests/engine/run/watched_run.h"
#include "tests/support/paths.h"

namespace viscera::test {
namespace {

TEST(Sight, TellsTheShareOfLooksThroughThickSmokeAndTheTraineesTime) {
  SceneDescription scene = watched_scene();
  // Smoke that no light comes through, right before the lens, from after the sixth look of twelve:
  // a look comes every 1/30 s, and a step emits where its end lies in the interval.
  EmitterDescription& emitter = scene.extras.get<SmokeDescriptions>()[0].emitters[0];
  emitter.rate = 1e-2;
  emitter.position = Vec3(0, -15e-3, 31e-3);
  emitter.speed = 0.0;
  emitter.when = {0.201, 10.0};
  auto world = build(scene);
  ASSERT_TRUE(world);
  StageClock clock;
  FrameViews::Makers makers{.scene = scene, .clock = clock};
  makers.endoscope.emplace(*scene.camera);
  Sight sight;
  RunReport report;
  sight.describe(*world, report);
  EXPECT_TRUE(report.sections.empty()) << "nobody has looked";
  Trace trace(stage_names());
  for (std::uint64_t picture = 0; picture < 12; ++picture) {
    step_frame(*world, trace);
    step_frame(*world, trace);
    FrameViews views(*world, makers, picture, picture);
    ASSERT_TRUE(sight.add_picture(views));
  }
  report.duration_s = world->time();
  sight.describe(*world, report);
  const Json all = Json::parse(to_json(report));
  const double share = all["smoke"]["time_in_smoke"];
  EXPECT_GT(share, 0.2);
  EXPECT_LE(share, 0.5);
  const double least = all["smoke"]["view_least"], last = all["smoke"]["view_at_end"];
  EXPECT_LT(least, 1.0);
  EXPECT_GT(least, 0.5) << "it hides the tip, not all of the view";
  EXPECT_GE(last, least);
  EXPECT_LE(last, 1.0);
  EXPECT_NEAR(all["trainee"]["time_in_smoke_s"].get<double>(), share * report.duration_s, 1e-12);
}

TEST(Sight, AsksForNothingWhereThereIsNoCamera) {
  const SceneDescription scene = watched_scene();
  auto world = build(scene);
  ASSERT_TRUE(world);
  StageClock clock;
  FrameViews::Makers makers{.scene = scene, .clock = clock};
  FrameViews views(*world, makers, 0, 0);
  Sight sight;
  ASSERT_TRUE(sight.add_picture(views));
  EXPECT_FALSE(sight.time_in_smoke());
}

}  // namespace
}  // namespace viscera::test
