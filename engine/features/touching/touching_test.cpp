// Organs that touch each other.
#include "engine/features/touching/touching.h"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <nlohmann/json.hpp>

#include "engine/features/links/links.h"
#include "engine/features/touching/touching_balls.h"
#include "engine/simulation/prepare.h"
#include "engine/simulator/build.h"
#include "engine/verification/two_balls.h"
#include "tests/support/paths.h"
#include "tests/support/same_runs.h"
#include "tests/support/small_world.h"

namespace viscera::test {
namespace {

constexpr double kRadius = 25e-3;
/// Of all cells of an organ, world [N].
Vec3 pressed(const World& world, std::size_t organ) {
  Vec3 sum = Vec3::Zero();
  for (const Vec3& force : world.all<OrganContact>()[organ].solution.forces) sum += force;
  return pose_of(world, world.model().organs()[organ]).direction_to_world(sum);
}

class TouchingBalls : public testing::TestWithParam<Response> {};

TEST_P(TouchingBalls, PressEachOtherAsHertzFoundAndEquallyHard) {
  const double approach = 1.5e-3;
  auto world = build(touching_balls(approach, GetParam(), {.edge = 1e-3, .pitch = 0.35}));
  ASSERT_TRUE(world);
  EXPECT_EQ(but_for_strain(step_until(*world, kBallsNearest)), FlagSet());
  const IsotropicMaterial material = world->all<OrganBody>()[0].model->material;
  const auto give = give_of_base(material, kRadius);
  ASSERT_TRUE(give);
  const double exact = hertz_held(material, kRadius, approach, *give).force;
  const Vec3 below = pressed(*world, 0), above = pressed(*world, 1);
  // Patches 1 mm apart under a disc of 4 mm.
  EXPECT_NEAR(-below.z(), exact, 0.08 * exact);
  EXPECT_LT((below + above).norm(), 1e-6 * above.norm());
  EXPECT_LT(world->one<TouchingFigures>()->greatest_overlap, 0.2e-3);
}
INSTANTIATE_TEST_SUITE_P(Responses, TouchingBalls,
                         testing::Values(Response::kLinear, Response::kFinite), kByResponse);

TEST(Touching, OrgansPassThroughEachOtherWhereTheSceneDoesntAskForContact) {
  auto scene = touching_balls(1.5e-3, Response::kLinear);
  scene.extras.set(TouchingDescription{});
  auto world = build(scene);
  ASSERT_TRUE(world);
  EXPECT_EQ(step_until(*world, kBallsNearest), FlagSet());
  EXPECT_FALSE(world->has<OrganPair>());
  EXPECT_FALSE(world->all<OrganState>()[0].deformed);
}

TEST(Touching, LocalOrgansWhichHaveNoNodesPressEachOther) {
  auto world = build(touching_balls(1.5e-3, Response::kLocal));
  ASSERT_TRUE(world);
  step_until(*world, kBallsNearest);
  const Vec3 below = pressed(*world, 0), above = pressed(*world, 1);
  EXPECT_GT(-below.z(), 1e-3);
  EXPECT_LT((below + above).norm(), 1e-6 * above.norm());
}

TEST(Touching, OrgansThatNothingMovesArentAsked) {
  auto scene = touching_balls(0.0, Response::kLinear);
  auto world = build(scene);
  ASSERT_TRUE(world);
  EXPECT_EQ(step_until(*world, 0.2), FlagSet());
  EXPECT_EQ(world->one<TouchingFigures>()->solves, 0u);
  EXPECT_TRUE(world->all<PairState>()[0].meetings.empty());
}

TEST(Touching, WhatLetsGoIsAtRestAgain) {
  auto world = build(touching_balls(1.5e-3, Response::kLinear));
  ASSERT_TRUE(world);
  step_until(*world, kBallsNearest);
  EXPECT_TRUE(world->all<OrganState>()[0].deformed);
  step_until(*world, 2.0 * kBallsNearest);
  step_until(*world, 2.0 * kBallsNearest + 0.05);
  EXPECT_EQ(pressed(*world, 0).norm(), 0.0);
  EXPECT_LT(world->all<OrganState>()[0].greatest_displacement, 1e-5);
}

TEST(Touching, OrgansThatOverlapAtRestKeepThatAndTellIt) {
  auto scene = touching_balls(0.5e-3, Response::kLinear);
  scene.organs[1].pose.position.z() -= 1e-3;
  auto world = build(scene);
  ASSERT_TRUE(world);
  // Vertices lie on the spheres, and a patch's mean a little below.
  EXPECT_NEAR(world->all<OrganPair>()[0].greatest_overlap, 1e-3, 0.15e-3);
  const auto told = nlohmann::json::parse(touching_report(*world)[0].json)["overlaps_at_rest"];
  ASSERT_EQ(told.size(), 1u);
  EXPECT_EQ(told[0]["between"], (nlohmann::json{"upper", "lower"})) << "patches are the first's";
  EXPECT_NEAR(told[0]["overlap_m"].get<double>(), 1e-3, 0.15e-3);
  EXPECT_EQ(step_until(*world, 1.0 / 60.0), FlagSet());
  EXPECT_LT(pressed(*world, 0).norm(), 1e-3);
  step_until(*world, kBallsNearest);
  EXPECT_GT(-pressed(*world, 0).z(), 5e-3) << "what comes nearer than at rest is pressed";
}

TEST(Touching, OrgansThatBeginDeepInsideEachOtherAreRefusedWithThePlace) {
  auto scene = touching_balls(0.5e-3, Response::kLinear);
  scene.organs[1].pose.position.z() -= 4e-3;
  std::vector<std::string> warnings;
  const auto world =
      build_world(scene, test_tissues(), {project_file("assets"), false}, no_progress(), warnings);
  ASSERT_FALSE(world);
  const std::string said = world.error().text();
  EXPECT_NE(said.find("organs/1/pose: \"upper\" begins "), std::string::npos) << said;
  EXPECT_NE(said.find(" mm inside \"lower\"; expected at most 3.0 mm"), std::string::npos) << said;
}

TEST(Touching, AToolThatPressesOneOrganIsFeltByTheOneBelow) {
  auto scene = touching_balls(0.0, Response::kLinear);
  // The upper ball hangs on its side.
  Region rim;
  rim.a = Vec3(15e-3, 0, 0);
  rim.b = Vec3(-1, 0, 0);
  scene.organs[1].fixed = {rim};
  const double tip = 5e-3, top = 3.0 * kRadius + tip;
  scene.instruments = {straight_tool(
      "probe", InstrumentKind::kProbe, tip,
      {{0.0, Vec3(0, 0, top + 1e-3), 0.0, 1.0}, {0.3, Vec3(0, 0, top - 6e-3), 0.0, 1.0}})};
  auto touching = build(scene);
  scene.extras.set(TouchingDescription{});
  auto apart = build(scene);
  ASSERT_TRUE(touching && apart);
  EXPECT_EQ(but_for_strain(step_until(*touching, 0.6)), FlagSet());
  step_until(*apart, 0.6);
  EXPECT_GT(-pressed(*touching, 0).z(), 1e-3);
  EXPECT_GT(force_on(*touching, 0).z(), 1.005 * force_on(*apart, 0).z());
}

TEST(Touching, LinksAndMeetingsOfAnIslandAreSolvedAsOne) {
  auto scene = touching_balls(1.5e-3, Response::kLinear);
  Region bed;
  bed.shape = Region::Shape::kSphere;
  bed.a = Vec3(0, 0, kRadius);
  bed.radius = 9e-3;
  scene.extras.set(LinkDescriptions{{"bed", {"lower", "upper"}, bed, 20.0}});
  auto world = build(scene);
  ASSERT_TRUE(world);
  EXPECT_EQ(but_for_strain(step_until(*world, kBallsNearest)), FlagSet());
  const LinkState& link = world->all<LinkState>()[0];
  double greatest = 0.0;
  for (const LinkState::Spring& spring : link.springs) {
    const Vec3 stretch = spring.displacements[1] + link.shift - spring.displacements[0];
    greatest = std::max(greatest, spring.force.norm());
    EXPECT_LT((spring.force - stretch / world->all<Link>()[0].softness).norm(),
              1e-4 * link.greatest_force);
  }
  EXPECT_GT(greatest, 0.0);
  const Vec3 below = pressed(*world, 0), above = pressed(*world, 1);
  EXPECT_LT((below + above).norm(), 1e-6 * above.norm());
}

TEST(Touching, ASavedStateGoesOnToTheSameBits) {
  for (const Response response : {Response::kLinear, Response::kFinite}) {
    auto world = build(touching_balls(1.5e-3, response));
    ASSERT_TRUE(world);
    step_until(*world, 0.3);
    expect_same_from_saved(*world, 0.4);
  }
}

TEST(Touching, AStateWithPatchesThatArentThereIsTakenWithoutThem) {
  auto world = build(touching_balls(1.5e-3, Response::kLinear));
  ASSERT_TRUE(world);
  step_until(*world, 0.3);
  PairState& state = world->all<PairState>()[0];
  ASSERT_FALSE(state.meetings.empty());
  state.meetings.front().patch = 1u << 30;
  state.meetings.back().on.point.triangle = 1 << 30;
  const auto bytes = world->save_state();
  auto other = start_world(world->shared_model());
  ASSERT_TRUE(other);
  ASSERT_TRUE((*other)->load_state(bytes));
  for (const Meeting& meeting : (*other)->all<PairState>()[0].meetings)
    EXPECT_LT(meeting.patch, 1u << 20);
  step_until(**other, 0.35);
}

}  // namespace
}  // namespace viscera::test
