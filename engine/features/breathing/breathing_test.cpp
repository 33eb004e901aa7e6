// Organs whose frames move as the patient breathes.
#include "engine/features/breathing/breathing.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numbers>
#include <utility>

#include "engine/simulator/build.h"
#include "tests/support/paths.h"
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

/// A bar between two holds, of which the right one breathes by 1 mm to the right, and the left one
/// by `left` of that.
SceneDescription bar_between_holds(Response response, double left) {
  SceneDescription scene = held_bar_scene(Vec3(60e-3, 16e-3, 16e-3), 2e-3, 6e-3, 5e-3, 5e-3);
  OrganDescription& bar = scene.organs[0];
  bar.response = response;
  Region right;
  right.a = Vec3(24e-3, 0, 0);
  right.b = -Vec3::UnitX();
  bar.fixed.push_back(right);
  const MotionDescription breath{1e-3, Vec3::UnitX(), 2.0, 0.0};
  MotionDescription less = breath;
  less.amplitude *= left;
  set_hold_motions(bar, {{0, less}, {1, breath}});
  return scene;
}

/// How far its drawn surface has moved along x, at least and at most, within `from` ... `to` [m].
std::pair<double, double> moved_between(const World& world, double from, double to) {
  const auto& rest = world.all<OrganBody>()[0].model->rest_positions;
  const auto& now = world.all<OrganState>()[0].positions;
  double least = 1.0, most = -1.0;
  for (std::size_t v = 0; v < rest.size(); ++v) {
    if (rest[v].x() < from || rest[v].x() > to) continue;
    least = std::min(least, static_cast<double>(now[v].x() - rest[v].x()));
    most = std::max(most, static_cast<double>(now[v].x() - rest[v].x()));
  }
  return {least, most};
}

class MovingHold : public testing::TestWithParam<Response> {};

TEST_P(MovingHold, StretchesWhatLiesBetweenItAndOneThatStays) {
  const auto world = build(bar_between_holds(GetParam(), 0.0));
  ASSERT_TRUE(world);
  EXPECT_EQ(step_until(*world, 1.0), FlagSet());
  const auto [left, left_most] = moved_between(*world, -30e-3, -29e-3);
  const auto [right, right_most] = moved_between(*world, 29e-3, 30e-3);
  const auto [middle, middle_most] = moved_between(*world, -1.5e-3, 1.5e-3);
  EXPECT_NEAR(left, 0.0, 2e-5);
  EXPECT_NEAR(left_most, 0.0, 2e-5);
  EXPECT_NEAR(right, 1e-3, 2e-5);
  EXPECT_NEAR(right_most, 1e-3, 2e-5);
  EXPECT_NEAR(middle, 0.5e-3, 6e-5);
  EXPECT_NEAR(middle_most, 0.5e-3, 6e-5);
  // And back, as it was.
  step_until(*world, 2.0);
  const auto [still, still_most] = moved_between(*world, -30e-3, 30e-3);
  EXPECT_NEAR(still, 0.0, 2e-5);
  EXPECT_NEAR(still_most, 0.0, 2e-5);
}

TEST_P(MovingHold, TakesTheWholeOrganAlongWhereAllItsHoldsMoveAlike) {
  for (const bool relaxes : {false, true}) {
    if (relaxes && GetParam() == Response::kLinear) continue;
    SceneDescription scene = bar_between_holds(GetParam(), 1.0);
    if (relaxes) scene.organs[0].material.prony = {{0.5, 0.3}};
    const auto world = build(scene);
    ASSERT_TRUE(world);
    for (const double time : {0.5, 0.75, 1.0, 1.4}) {
      EXPECT_EQ(step_until(*world, time), FlagSet());
      const double now = world->all<HoldWays>()[0].ways[1].x();
      EXPECT_EQ(world->all<HoldWays>()[0].ways[0].x(), now);
      const auto [least, most] = moved_between(*world, -30e-3, 30e-3);
      // At finite strain mass and viscosity count.
      EXPECT_NEAR(least, now, 1e-5) << time << ' ' << relaxes;
      EXPECT_NEAR(most, now, 1e-5) << time << ' ' << relaxes;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Responses, MovingHold,
                         testing::Values(Response::kLinear, Response::kFinite), kByResponse);

TEST_P(MovingHold, ThatHoldsNoneOfTheSurfaceIsRefused) {
  SceneDescription scene = bar_between_holds(GetParam(), 0.0);
  scene.organs[0].fixed[1] = scene.organs[0].fixed[0];
  std::vector<std::string> warnings;
  const auto world = build_world(
      scene, test_tissues(), {project_file("assets"), false},
      [](double, std::string_view) { return true; }, warnings);
  ASSERT_FALSE(world);
  EXPECT_NE(world.error().text().find("moving_holds: found region 1 of fixed, which holds no"),
            std::string::npos)
      << world.error().text();
}

TEST(Breathing, AnOrganWhoseHoldBreathesIsAtFiniteStrainWhereTheSceneDoesntSay) {
  SceneDescription scene = bar_between_holds(Response::kAuto, 0.0);
  scene.instruments = {
      straight_tool("tip", InstrumentKind::kProbe, 2e-3, {{0.0, Vec3(0, 0, 11e-3), 0.0, 1.0}})};
  const auto world = build(scene);
  ASSERT_TRUE(world);
  EXPECT_TRUE(world->all<OrganBody>()[0].model->finite);
}

}  // namespace
}  // namespace viscera::test
