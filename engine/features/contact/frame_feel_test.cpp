#include "engine/features/contact/frame_feel.h"

#include <gtest/gtest.h>

namespace viscera::test {
namespace {

AsFrameFound pressed() {
  return {Vec3(0, 0, 1.0), 200.0 * Mat3::Identity(), Vec3::Zero()};
}

TEST(FrameFeel, FeelsNothingBeforeAFrameSaysSo) {
  FrameFeel feel;
  const TactileForce answer = feel.respond(Vec3(1, 2, 3), 1e-3);
  EXPECT_EQ(answer.force, Vec3::Zero());
  EXPECT_FALSE(answer.touching);
  EXPECT_EQ(answer.energy, 0.0);
}

TEST(FrameFeel, EasesAFramesForceInAndFollowsTheTipByItsStiffness) {
  FrameFeel feel;
  feel.frames().back() = pressed();
  feel.frames().publish();
  double last = feel.respond(Vec3::Zero(), 1e-3).force.z();
  EXPECT_LT(last, 0.1);
  for (int tick = 0; tick < 200; ++tick) {
    const double now = feel.respond(Vec3::Zero(), 1e-3).force.z();
    EXPECT_GE(now, last);
    last = now;
  }
  EXPECT_NEAR(last, 1.0, 1e-4);
  EXPECT_NEAR(feel.respond(Vec3(0, 0, -1e-3), 1e-3).force.z(), 1.2, 1e-4);
}

TEST(FrameFeel, NeverPulls) {
  FrameFeel feel;
  feel.frames().back() = pressed();
  feel.frames().publish();
  for (int tick = 0; tick < 200; ++tick) feel.respond(Vec3::Zero(), 1e-3);
  const TactileForce answer = feel.respond(Vec3(0, 0, 6e-3), 1e-3);
  EXPECT_LT(answer.force.norm(), 1e-4);
  EXPECT_EQ(answer.stiffness, Mat3::Zero());
}

TEST(FrameFeel, ASavedStateGoesOnToTheSameBits) {
  FrameFeel feel, other;
  feel.frames().back() = pressed();
  feel.frames().publish();
  for (int tick = 0; tick < 5; ++tick) feel.respond(Vec3::Zero(), 1e-3);
  ASSERT_TRUE(FrameFeel::fits(feel.state()));
  other.restore(feel.state());
  EXPECT_EQ(feel.respond(Vec3(0, 0, 1e-4), 1e-3).force,
            other.respond(Vec3(0, 0, 1e-4), 1e-3).force);
}

}  // namespace
}  // namespace viscera::test
