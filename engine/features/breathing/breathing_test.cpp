// Organs whose frames move as the patient breathes.
#include "engine/features/breathing/breathing.h"

#include <gtest/gtest.h>

#include <numbers>

#include "tests/support/small_world.h"

namespace viscera::test {
namespace {

constexpr double kTop = 25e-3;    // pole of the ball [m]
constexpr double kRadius = 4e-3;  // of the tip [m]

MotionDescription rising(double way, double period) {
  return {way, Vec3::UnitZ(), period, 0.0};
}

TEST(Breathing, StartsAtThePoseGoesToItsAmplitudeAndComesBack) {
  const MotionDescription breath{6e-3, -Vec3::UnitY(), 4.0, 0.0};
  EXPECT_EQ(breath.displacement(0.0), Vec3(0, 0, 0));
  EXPECT_LT((breath.displacement(2.0) - Vec3(0, -6e-3, 0)).norm(), 1e-12);
  EXPECT_LT(breath.displacement(4.0).norm(), 1e-12);
  // The pause: less than a twentieth of the way for a quarter of the time.
  EXPECT_LT(breath.displacement(0.5).norm(), 0.05 * 6e-3);
  EXPECT_LT(breath.displacement(3.5).norm(), 0.05 * 6e-3);
  const MotionDescription later{6e-3, -Vec3::UnitY(), 4.0, std::numbers::pi};
  EXPECT_LT((later.displacement(0.0) - breath.displacement(2.0)).norm(), 1e-12);
}

TEST(Breathing, TissueThatComesToATipPressesAsATipThatComesToTissue) {
  constexpr double kWay = 3e-3;
  auto pressed = soft_ball_scene(6e-3, 3.5e-3);
  auto breathing = pressed;
  const double high = kTop + kRadius + 1e-3;
  pressed.instruments = {
      straight_tool("tip", InstrumentKind::kProbe, kRadius,
                    {{0.0, Vec3(0, 0, high), 0.0, 1.0}, {1.0, Vec3(0, 0, high - kWay), 0.0, 1.0}})};
  breathing.instruments = {
      straight_tool("tip", InstrumentKind::kProbe, kRadius, {{0.0, Vec3(0, 0, high), 0.0, 1.0}})};
  set_motion(breathing.organs[0], rising(kWay, 2.0));
  const auto one = build(pressed), other = build(breathing);
  ASSERT_TRUE(one && other);
  EXPECT_EQ(but_for_strain(step_until(*one, 1.0)), FlagSet());
  EXPECT_EQ(but_for_strain(step_until(*other, 1.0)), FlagSet());
  const double force = force_on(*one, 0).norm();
  EXPECT_GT(force, 0.05);
  EXPECT_NEAR(force_on(*other, 0).norm(), force, 0.03 * force);
  // The drawn surface stays in the organ's frame, which has moved.
  EXPECT_LT((other->all<OrganPose>()[0].pose.position - breathing.organs[0].pose.position -
             Vec3(0, 0, kWay))
                .norm(),
            1e-12);
  step_until(*other, 2.0);
  EXPECT_EQ(force_on(*other, 0).norm(), 0.0);
}

TEST(Breathing, PullsAtAJawThatStaysAndNotAtOneThatMovesAlong) {
  constexpr double kWay = 2e-3;
  auto scene = soft_ball_scene(6e-3, 3.5e-3);
  const double at = kTop + kRadius + 0.2e-3;
  const MotionDescription motion{kWay, -Vec3::UnitZ(), 4.0, 0.0};
  set_motion(scene.organs[0], motion);
  auto still = scene;
  still.instruments = {
      straight_tool("jaw", InstrumentKind::kGrasper, kRadius,
                    {{0.0, Vec3(0, 0, at), 0.0, 1.0}, {0.1, Vec3(0, 0, at), 0.0, 0.0}})};
  auto along = scene;
  std::vector<InstrumentKey> keys = {{0.0, Vec3(0, 0, at), 0.0, 1.0}};
  for (double time = 0.1; time <= 2.0; time += 0.02)
    keys.push_back({time, Vec3(0, 0, at) + motion.displacement(time), 0.0, 0.0});
  along.instruments = {straight_tool("jaw", InstrumentKind::kGrasper, kRadius, keys)};
  const auto one = build(still), other = build(along);
  ASSERT_TRUE(one && other);
  step_until(*one, 1.9);
  step_until(*other, 1.9);
  ASSERT_TRUE(one->all<InstrumentContact>()[0].grasp && other->all<InstrumentContact>()[0].grasp);
  EXPECT_LT(force_on(*one, 0).z(), -0.05);
  EXPECT_LT(force_on(*other, 0).norm(), 0.02 * force_on(*one, 0).norm());
}

}  // namespace
}  // namespace viscera::test
