// Organs that nothing holds.
#include "engine/features/free_bodies/free_bodies.h"

#include <gtest/gtest.h>

#include <cmath>

#include "engine/features/finite/finite.h"
#include "engine/features/free_bodies/block_on_floor.h"
#include "engine/features/gravity/gravity_keys.h"
#include "engine/features/touching/touching.h"
#include "engine/simulator/build.h"
#include "kernels/points/surface.h"
#include "tests/support/paths.h"
#include "tests/support/same_runs.h"
#include "tests/support/small_world.h"

namespace viscera::test {
namespace {

constexpr double kGravity = 9.81, kStep = 1.0 / 60.0;

/// Mean displacement of an organ's drawn surface [m].
Vec3 moved(const World& world, std::size_t organ) {
  const OrganState& state = world.all<OrganState>()[organ];
  const OrganModel& model = *world.all<OrganBody>()[organ].model;
  Vec3 sum = Vec3::Zero();
  for (std::size_t v = 0; v < state.positions.size(); ++v)
    sum += (state.positions[v] - model.rest_positions[v]).cast<double>();
  return sum / static_cast<double>(state.positions.size());
}

double fastest(const World& world, Entity organ) {
  double most = 0.0;
  const auto& motion = world.find<OrganTouch>(organ)->solver->state().motion;
  for (const double v : motion.velocities) most = std::max(most, std::abs(v));
  return most;
}

double weight(const World& world, std::size_t organ) {
  constexpr double kDensity = 1060.0;
  return kDensity * kGravity * std::abs(volume(world.all<OrganBody>()[organ].model->surface));
}

Vec3 pressed(const World& world, std::size_t organ) {
  Vec3 sum = Vec3::Zero();
  for (const Vec3& force : world.all<OrganContact>()[organ].solution.forces) sum += force;
  return sum;
}

TEST(FreeBodies, FallAsGravitySays) {
  SceneDescription scene = block_on_floor({.above = 0.4});
  auto world = build(scene);
  ASSERT_TRUE(world);
  EXPECT_EQ(step_until(*world, 0.16), FlagSet());
  // Steps are implicit: they take the speed of their end.
  const auto steps = static_cast<double>(world->frame());
  EXPECT_NEAR(moved(*world, 0).z(), -kGravity * kStep * kStep * steps * (steps + 1) / 2, 1e-5);
  EXPECT_LT(moved(*world, 0).head<2>().norm(), 1e-5);
}

TEST(FreeBodies, ComeToRestOnWhatLiesBelowAndPressItByTheirWeight) {
  auto world = build(block_on_floor({.above = 5e-3}));
  ASSERT_TRUE(world);
  const Entity block = world->model().organs()[0];
  step_until(*world, 1.0);
  EXPECT_EQ(step_until(*world, 1.5), FlagSet());
  EXPECT_LT(fastest(*world, block), 1e-3);
  EXPECT_NEAR(pressed(*world, 0).z(), weight(*world, 0), 0.01 * weight(*world, 0));
  EXPECT_LT(world->one<TouchingFigures>()->greatest_overlap, 0.2e-3);
  EXPECT_NEAR(moved(*world, 0).z(), -5e-3, 0.5e-3);
}

TEST(FreeBodies, OfStiffTissueTumbleAndLandToo) {
  SceneDescription scene = block_on_floor({.above = 5e-3, .friction = 0.9, .slope = 0.4});
  scene.organs[0].youngs_modulus = 250e3;
  scene.organs[0].pose.orientation = Eigen::AngleAxisd(0.3, Vec3(1.0, 2.0, 0.5).normalized());
  scene.organs[0].pose.position.z() += 8e-3;
  auto world = build(scene);
  ASSERT_TRUE(world);
  const FlagSet flags = step_until(*world, 0.6);
  EXPECT_EQ(flags, FlagSet());
  EXPECT_LT(world->find<FiniteFigures>(world->model().organs()[0])->greatest_residual, 1e-3);
  // As the mass that meets the floor stops within a step of 1/60 s, at most.
  EXPECT_LT(world->one<TouchingFigures>()->greatest_force, 30.0 * weight(*world, 0));
}

TEST(FreeBodies, GainNoEnergyWhereTheyLand) {
  auto world = build(block_on_floor({.above = 20e-3}));
  ASSERT_TRUE(world);
  double highest = -1.0;
  bool landed = false;
  while (world->time() < 1.5) {
    step_until(*world, end_of_step(*world));
    landed = landed || pressed(*world, 0).z() > 0.0;
    if (landed) highest = std::max(highest, moved(*world, 0).z());
  }
  EXPECT_TRUE(landed);
  EXPECT_LT(highest, -10e-3);
}

TEST(FreeBodies, ThatLieOnSomethingInsideOutTakeTheirShapeAgain) {
  auto world = build(block_on_floor({.above = 0.5e-3, .friction = 1.2}));
  ASSERT_TRUE(world);
  step_until(*world, 0.5);
  const Entity block = world->model().organs()[0];
  TissueContact& solver = *world->find<OrganTouch>(block)->solver;
  auto turned = solver.state();
  for (std::size_t at = 2; at < turned.motion.displacements.size(); at += 3 * 7)
    turned.motion.displacements[at] += 20e-3;
  solver.restore(std::move(turned));
  while (world->time() < 1.0) {
    step_until(*world, end_of_step(*world));
    // What no step was found with stays with nothing that meets.
    for (const PairState& pair : world->all<PairState>())
      for (const Meeting& meeting : pair.meetings) {
        EXPECT_LT(meeting.force.norm(), 10.0) << world->time();
        EXPECT_LT(meeting.cling.norm(), 0.1) << world->time();
      }
  }
  const std::uint64_t lost = world->find<FiniteFigures>(block)->lost;
  EXPECT_GT(lost, 0u) << "no step leads back from that";
  EXPECT_LT(lost, 5u);
  step_until(*world, 2.0);
  EXPECT_EQ(world->find<FiniteFigures>(block)->lost, lost);
  EXPECT_NEAR(pressed(*world, 0).z(), weight(*world, 0), 0.02 * weight(*world, 0));
  EXPECT_NEAR(moved(*world, 0).z(), -0.5e-3, 1e-3);
}

TEST(FreeBodies, SlideWhereTheSlopeIsSteeperThanFrictionHolds) {
  const double friction = 0.3;
  const auto way = [&](double slope) {
    auto world = build(block_on_floor({.friction = friction, .slope = std::atan(slope)}));
    if (!world) return Vec3(Vec3::Zero());
    step_until(*world, 0.5);
    const Vec3 before = moved(*world, 0);
    step_until(*world, 1.0);
    return Vec3(moved(*world, 0) - before);
  };
  EXPECT_LT(way(0.99 * friction).norm(), 0.05e-3);
  EXPECT_LT(way(1.03 * friction).y(), -3e-3);
}

/// A ball as BlockOnFloor's block, so high above the floor.
OrganDescription ball_above(const SceneDescription& scene, double height) {
  constexpr double kRadius = 10e-3;
  OrganDescription ball = scene.organs[0];
  RecipeGeometry sphere;
  sphere.recipe = "sphere";
  sphere.radius = kRadius;
  sphere.edge = 3e-3;
  ball.geometry = sphere;
  ball.name = "ball";
  ball.pose.position.z() = kRadius + height;
  return ball;
}

TEST(FreeBodies, RollDownASlopeWhereFrictionHoldsSlowerThanRigidOnes) {
  constexpr double kSlope = 0.1;
  SceneDescription scene = block_on_floor({.friction = 0.8, .slope = kSlope});
  scene.organs[0] = ball_above(scene, 0.1e-3);
  auto world = build(scene);
  ASSERT_TRUE(world);
  EXPECT_EQ(step_until(*world, 0.6), FlagSet());
  // 5/7 of what slides. A soft one loses at every patch that it comes to.
  const double rigid = 5.0 / 7.0 * 0.5 * kGravity * std::sin(kSlope) * 0.6 * 0.6;
  EXPECT_LT(moved(*world, 0).y(), -0.25 * rigid);
  EXPECT_GT(moved(*world, 0).y(), -rigid);
}

TEST(FreeBodies, LieOnEachOtherAndPressOppositely) {
  SceneDescription scene = block_on_floor({.friction = 0.5});
  scene.organs.push_back(ball_above(scene, 15.5e-3));
  auto world = build(scene);
  ASSERT_TRUE(world);
  EXPECT_EQ(step_until(*world, 0.5), FlagSet());
  const double whole = weight(*world, 0) + weight(*world, 2);
  EXPECT_NEAR(pressed(*world, 0).z() + pressed(*world, 1).z(), whole, 0.05 * whole);
  EXPECT_NEAR(pressed(*world, 1).z(), weight(*world, 2), 0.05 * weight(*world, 2));
}

TEST(FreeBodies, GoOnFromASavedStateToTheSameBits) {
  auto world = build(block_on_floor({.above = 2e-3}));
  ASSERT_TRUE(world);
  step_until(*world, 0.2);
  expect_same_from_saved(*world, 0.4);
}

TEST(FreeBodies, ThatFallOutOfViewAreToldAndStayThere) {
  SceneDescription scene = block_on_floor({});
  scene.organs.resize(1);
  auto world = build(scene);
  ASSERT_TRUE(world);
  const FlagSet flags = step_until(*world, 0.6);
  EXPECT_TRUE(flags.has(kOutOfView));
  EXPECT_EQ(flags.size(), 1u);
  EXPECT_TRUE(is_gone(*world, world->model().organs()[0]));
  const Vec3 there = moved(*world, 0);
  EXPECT_EQ(step_until(*world, 1.0).size(), 1u);
  EXPECT_EQ(moved(*world, 0), there);
}

std::string refused(const SceneDescription& scene) {
  std::vector<std::string> warnings;
  auto world =
      build_world(scene, test_tissues(), {project_file("assets"), false}, no_progress(), warnings);
  return world ? "" : world.error().text();
}

TEST(FreeBodies, AreRefusedWithThePlaceWhereTheyCantBe) {
  SceneDescription scene = block_on_floor({});
  scene.extras.set(TouchingDescription{});
  EXPECT_NE(refused(scene).find("organs/0/free: found true without contact/organs"),
            std::string::npos)
      << refused(scene);
  scene = block_on_floor({.above = -3e-3});
  EXPECT_NE(refused(scene).find("organs/0/pose: \"block\", which nothing holds, begins "),
            std::string::npos)
      << refused(scene);
  scene = block_on_floor({});
  Region below;
  below.b = Vec3::UnitZ();
  scene.organs[0].fixed = {below};
  scene.organs[0].response = Response::kLinear;
  scene.organs[0].finite.quasi_static = true;
  const std::string said = refused(scene);
  EXPECT_NE(said.find("organs/0/fixed: found regions with free"), std::string::npos) << said;
  EXPECT_NE(said.find("organs/0/response: found another with free"), std::string::npos) << said;
  EXPECT_NE(said.find("organs/0/finite/quasi_static: found true"), std::string::npos) << said;
}

TEST(Coming, CountsWhatGoesTowardsAPlaceAndSomeOfWhatGoesAlongIt) {
  const Coming coming{Vec3(0.0, 0.0, -4e-3), 1e-3};
  EXPECT_DOUBLE_EQ(coming.at_most(), 5e-3);
  EXPECT_DOUBLE_EQ(coming.towards(Vec3::UnitZ()), 4e-3);
  EXPECT_DOUBLE_EQ(coming.towards(Vec3::UnitX()), 1e-3);
  EXPECT_DOUBLE_EQ(coming.towards(-Vec3::UnitZ()), 1e-3);
  const Coming pieces{Vec3(0.0, 0.0, -4e-3), 1e-3, false};
  EXPECT_DOUBLE_EQ(pieces.towards(-Vec3::UnitZ()), 5e-3);
}

}  // namespace
}  // namespace viscera::test
