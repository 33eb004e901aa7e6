#include "engine/run/frame_views.h"

#include <gtest/gtest.h>

#include "engine/gpu/egl_context.h"
#include "engine/simulator/build.h"
#include "tests/engine/run/watched_run.h"

namespace viscera::test {
namespace {

TEST(FrameViews, MakeSmokeOnceHoweverManyAskAndNotWhereNobodyDoes) {
  const SceneDescription scene = watched_scene();
  auto world = build(scene);
  ASSERT_TRUE(world);
  step_until(*world, 0.3);
  StageClock clock;
  FrameViews::Makers makers{.scene = scene, .clock = clock};
  Trace trace(stage_names());
  { FrameViews unasked(*world, makers, 0, 0); }
  clock.tell(trace, 1);
  EXPECT_EQ(trace.size(), 0u);
  FrameViews views(*world, makers, 0, 0);
  const std::span<const ShownSmoke> first = views.smoke(), second = views.smoke();
  ASSERT_EQ(first.size(), 1u);
  EXPECT_EQ(first.data(), second.data());
  EXPECT_FALSE(first[0].grid.density.empty());
  clock.tell(trace, 2);
  EXPECT_EQ(trace.size(), 1u);
}

TEST(FrameViews, OfARunWithoutPicturesHaveNone) {
  const SceneDescription scene = watched_scene();
  auto world = build(scene);
  ASSERT_TRUE(world);
  StageClock clock;
  FrameViews::Makers makers{.scene = scene, .clock = clock};
  EXPECT_FALSE(FrameViews(*world, makers, 0, 0).shot());
  EXPECT_FALSE(FrameViews(*world, makers, 0, 0).camera());
}

TEST(FrameViews, DrawOnePictureHoweverManyAsk) {
  if (const auto context = EglContext::create(); !context) GTEST_SKIP() << context.error().text();
  const SceneDescription scene = watched_scene();
  auto world = build(scene);
  ASSERT_TRUE(world);
  step_until(*world, 0.3);
  auto studio = Studio::open({64, 48, Quality::kDraft, true}, nullptr);
  ASSERT_TRUE(studio) << studio.error().text();
  StageClock clock;
  FrameViews::Makers makers{.scene = scene, .studio = studio->get(), .clock = clock};
  makers.endoscope.emplace(*scene.camera);
  FrameViews views(*world, makers, 8, 8);
  const auto first = views.shot();
  ASSERT_TRUE(first) << first.error().text();
  EXPECT_EQ(first->picture.rgb.size(), 64u * 48u * 3u);
  EXPECT_EQ(first->view.frame, 8u);
  ASSERT_TRUE(first->passes);
  // A draft's passes have half the picture's width and height.
  EXPECT_EQ(first->passes->width, 32);
  EXPECT_EQ(first->passes->height, 24);
  EXPECT_EQ(first->passes->depth.size(), 32u * 24u);
  const auto second = views.shot();
  ASSERT_TRUE(second);
  EXPECT_EQ(first->passes, second->passes) << "it wasn't drawn again";
  Trace trace(stage_names());
  clock.tell(trace, 16);
  EXPECT_EQ(trace.durations(stage_index(RunStage::kDraw)).count, 1u);
  EXPECT_EQ(trace.durations(stage_index(RunStage::kSplatSmoke)).count, 1u);
}

}  // namespace
}  // namespace viscera::test
