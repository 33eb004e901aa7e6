#include "engine/features/breathing/breathing_keys.h"

#include <gtest/gtest.h>

#include <numbers>

#include "tests/engine/scene/scene_fixture.h"

namespace viscera::test {
namespace {

TEST(BreathingKeys, ArriveInSiUnits) {
  const Result<SceneDescription> scene = SceneFolder().load(whole_scene());
  ASSERT_TRUE(scene) << scene.error().text();
  const MotionDescription* motion = motion_of(scene->organs[0]);
  ASSERT_TRUE(motion);
  EXPECT_EQ(motion->amplitude, 0.006);
  EXPECT_EQ(motion->direction, Vec3(0, -1, 0));
  EXPECT_EQ(motion->period, 5.0);
  EXPECT_DOUBLE_EQ(motion->phase, 0.5 * std::numbers::pi);
}

TEST(BreathingKeys, OfHoldsArriveInSiUnits) {
  const Result<SceneDescription> scene = SceneFolder().load(whole_scene());
  ASSERT_TRUE(scene) << scene.error().text();
  const std::vector<HoldMotion>& holds = hold_motions_of(scene->organs[0]);
  ASSERT_EQ(holds.size(), 1u);
  EXPECT_EQ(holds[0].hold, 0);
  EXPECT_EQ(holds[0].motion.amplitude, 0.003);
  EXPECT_EQ(holds[0].motion.direction, Vec3(0, 0, 1));
  EXPECT_EQ(holds[0].motion.period, 6.0);
  EXPECT_DOUBLE_EQ(holds[0].motion.phase, std::numbers::pi);
  EXPECT_TRUE(hold_motions_of(scene->organs[1]).empty());
}

TEST(BreathingKeys, AMovingHoldThatIsNoneOfTheRegionsIsRefused) {
  EXPECT_ONE_MISTAKE(mistakes_with("/organs/0/moving_holds/0/fixed", 7),
                     "organs/0/moving_holds/0/fixed", "found 7, expected the index of one of the");
}

TEST(BreathingKeys, MoveTheFrameOfTheOrganThatHasThemAndNoOther) {
  const Result<SceneDescription> scene = SceneFolder().load(whole_scene());
  ASSERT_TRUE(scene) << scene.error().text();
  const OrganDescription& breathing = scene->organs[0];
  EXPECT_EQ(breathing.pose_at(1.0).position,
            breathing.pose.position + motion_of(breathing)->displacement(1.0));
  const OrganDescription& still = scene->organs[1];
  EXPECT_FALSE(motion_of(still));
  EXPECT_EQ(still.pose_at(1.0).position, still.pose.position);
}

TEST(BreathingKeys, AWayWithoutADirectionIsRefused) {
  EXPECT_ONE_MISTAKE(mistakes_with("/organs/0/motion/direction", {0, 0, 0}),
                     "organs/0/motion/direction", "found [0,0,0], expected a direction");
}

}  // namespace
}  // namespace viscera::test
