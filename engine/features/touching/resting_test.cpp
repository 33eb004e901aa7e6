// Organs that have come to rest on each other, and what wakes them.
#include "engine/features/touching/resting.h"

#include <gtest/gtest.h>

#include "engine/features/breathing/breathing_keys.h"
#include "engine/features/deformation/deformation.h"
#include "engine/features/finite/finite.h"
#include "engine/features/free_bodies/block_on_floor.h"
#include "engine/features/gravity/gravity_keys.h"
#include "engine/features/touching/touching.h"
#include "engine/simulator/simulation.h"
#include "tests/support/small_world.h"

namespace viscera::test {
namespace {

constexpr double kHasSettled = 1.9;  // [s]

std::uint64_t steps_of(const World& world, std::size_t organ) {
  return world.find<FiniteFigures>(world.model().organs()[organ])->steps;
}

bool organ_rests(const World& world, std::size_t organ) {
  return rests(world, world.model().organs()[organ]);
}

/// A wall that goes 4 mm to the feet (-y) and back, and comes to the block after a while.
SceneDescription block_and_wall() {
  SceneDescription scene = block_on_floor({.above = 0.5e-3, .friction = 0.5});
  scene.duration = 6.0;
  scene.organs.push_back(scene.organs[1]);
  OrganDescription& wall = scene.organs[2];
  wall.name = "wall";
  auto geometry = std::get<RecipeGeometry>(wall.geometry);
  geometry.size = Vec3(60e-3, 20e-3, 60e-3);
  wall.geometry = geometry;
  wall.pose.position = Vec3(0.0, 28e-3, 31e-3);
  set_motion(wall, {.amplitude = 4e-3, .period = 6.0});
  return scene;
}

/// Until what lies on the floor rests, or a while later.
void settle(World& world) {
  while (world.time() < kHasSettled && !organ_rests(world, 0))
    step_until(world, end_of_step(world));
}

TEST(RestingOrgans, AreNeitherSolvedNorDrawn) {
  auto world = build(block_on_floor({.above = 1e-3, .friction = 0.5}));
  ASSERT_TRUE(world);
  settle(*world);
  ASSERT_TRUE(organ_rests(*world, 0)) << world->time();
  const std::uint64_t steps = steps_of(*world, 0), solves = world->one<TouchingFigures>()->solves;
  const std::uint64_t version = world->all<OrganState>()[0].version;
  step_until(*world, world->time() + 0.5);
  EXPECT_EQ(steps_of(*world, 0), steps);
  EXPECT_EQ(world->one<TouchingFigures>()->solves, solves);
  EXPECT_EQ(world->all<OrganState>()[0].version, version);
  EXPECT_EQ(world->one<TouchingFigures>()->most_resting, 1u);
}

TEST(RestingOrgans, AreNeitherAskedNorLookedOverOnceAllOfThemRest) {
  auto world = build(block_and_wall());
  ASSERT_TRUE(world);
  bool rested = false;
  while (world->time() < 3.0) {
    step_until(*world, end_of_step(*world));
    EXPECT_EQ(all_stay(*world), organ_rests(*world, 0)) << world->time();
    // A wall that comes nearer is asked after, though nothing has woken yet.
    const Vec3 wall = pose_of(*world, world->model().organs()[2]).position;
    if (all_at_rest(*world)) {
      EXPECT_EQ(world->one<AllAtRest>()->positions[2], wall);
    }
    rested = rested || (all_at_rest(*world) && all_stay(*world));
  }
  EXPECT_TRUE(rested);
  EXPECT_FALSE(all_at_rest(*world));
}

TEST(RestingOrgans, WakeAsGravityTurnsAndSlideThen) {
  SceneDescription scene = block_on_floor({.above = 0.5e-3, .friction = 0.3});
  scene.duration = 4.0;
  scene.extras.set(GravityDescription{.table = {{.time = 0.0, .head_up = 0.0},
                                                {.time = 2.0, .head_up = 0.0},
                                                {.time = 3.0, .head_up = 0.4}}});
  auto world = build(scene);
  ASSERT_TRUE(world);
  step_until(*world, kHasSettled);
  ASSERT_TRUE(organ_rests(*world, 0));
  step_until(*world, 3.0);
  EXPECT_FALSE(organ_rests(*world, 0));
  EXPECT_GT(world->all<OrganState>()[0].greatest_displacement, 3e-3);
}

TEST(RestingOrgans, WakeWhereWhatMovesComesToThem) {
  auto world = build(block_and_wall());
  ASSERT_TRUE(world);
  settle(*world);
  ASSERT_TRUE(organ_rests(*world, 0)) << world->time();
  while (world->time() < 3.0 && organ_rests(*world, 0)) step_until(*world, end_of_step(*world));
  EXPECT_FALSE(organ_rests(*world, 0));
  step_until(*world, 3.0);
  EXPECT_GT(world->all<OrganState>()[0].greatest_displacement, 1e-3);
  EXPECT_LT(world->one<TouchingFigures>()->greatest_overlap, 0.2e-3);
}

TEST(RestingOrgans, WakeUnderATool) {
  SceneDescription scene = block_on_floor({.above = 0.5e-3, .friction = 0.5});
  scene.duration = 3.0;
  scene.instruments = {straight_tool("probe", InstrumentKind::kProbe, 4e-3,
                                     {{.time = 0.0, .tip = {0.0, 0.0, 40e-3}},
                                      {.time = 1.8, .tip = {0.0, 0.0, 40e-3}},
                                      {.time = 2.6, .tip = {0.0, 0.0, 17e-3}}})};
  auto world = build(scene);
  ASSERT_TRUE(world);
  step_until(*world, 1.8);
  ASSERT_TRUE(organ_rests(*world, 0));
  step_until(*world, 2.6);
  EXPECT_FALSE(organ_rests(*world, 0));
  EXPECT_GT(world->all<InstrumentContact>()[0].force.z(), 0.0);
}

TEST(RestingOrgans, GoOnFromASnapshotWithTheSameBits) {
  const Model model = build_shared(block_and_wall());
  auto whole = Simulation::create(model), other = Simulation::create(model);
  ASSERT_TRUE(whole && other);
  while (whole->frame() < 114 && !organ_rests(whole->world(), 0)) whole->step();
  ASSERT_TRUE(organ_rests(whole->world(), 0));
  const auto resting = whole->snapshot();
  ASSERT_TRUE(resting) << resting.error().text();
  ASSERT_TRUE(other->restore(*resting));
  for (int frame = 0; frame < 120; ++frame) {
    whole->step();
    other->step();
  }
  EXPECT_EQ(other->hash(), whole->hash()) << other->world().state_difference(whole->world());
}

}  // namespace
}  // namespace viscera::test
