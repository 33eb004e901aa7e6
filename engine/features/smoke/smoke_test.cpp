// Smoke in a world: what feeds it, what it meets, where it goes.
#include "engine/features/smoke/smoke.h"

#include <gtest/gtest.h>
#include <oneapi/tbb/global_control.h>

#include "engine/features/cautery/cautery.h"
#include "engine/features/gas/gas.h"
#include "engine/features/smoke/puffs.h"
#include "engine/features/smoke/smoke_setup.h"
#include "engine/run/view.h"
#include "engine/simulator/build.h"
#include "tests/support/small_world.h"

namespace viscera::test {
namespace {

constexpr double kRadius = 25e-3;  // of the ball at the origin

/// A steady source of warm smoke over the ball's pole.
EmitterDescription steady(double rate) {
  EmitterDescription emitter;
  emitter.position = Vec3(0, 0, kRadius + 6e-3);
  emitter.rate = rate;
  emitter.particles = 600;
  return emitter;
}

SceneDescription smoking_scene(std::vector<EmitterDescription> emitters) {
  SceneDescription scene = soft_ball_scene(8e-3, 5e-3);
  SmokeDescription smoke;
  smoke.name = "plume";
  smoke.domain = Box(Vec3(-40e-3, -40e-3, -30e-3), Vec3(40e-3, 40e-3, 90e-3));
  smoke.emitters = std::move(emitters);
  scene.extras.set(SmokeDescriptions{smoke});
  scene.extras.get<GasDescription>().cells = 16;
  return scene;
}

double sum_of(const SmokeBody& smoke) {
  const SmokeBook& book = smoke.volume.book();
  return smoke.volume.airborne() + book.background + book.evacuated + book.leaked + book.deposited;
}

TEST(SmokeStages, ASteadySourceGivesItsRateWhileItIsOn) {
  EmitterDescription source = steady(2e-6);
  source.when = {0.2, 0.7};
  auto world = build(smoking_scene({source}));
  ASSERT_TRUE(world);
  step_until(*world, 0.1);
  EXPECT_EQ(world->all<SmokeBody>()[0].volume.particles().size(), 0u);
  step_until(*world, 1.2);
  EXPECT_NEAR(world->all<SmokeBody>()[0].volume.book().emitted, 2e-6 * 0.5, 2e-6 / 30.0);
  EXPECT_NEAR(static_cast<double>(world->all<SmokeBody>()[0].volume.counters().emitted), 300.0,
              20.0);
}

TEST(SmokeStages, AsMuchFlowsOutInStepsTwiceAsLong) {
  SmokeBook books[2];
  double airborne[2];
  for (const std::size_t longer : {0, 1}) {
    const StepRate steps{.per_second = longer ? 30u : 60u};
    SceneDescription scene = smoking_scene({steady(2e-6)});
    scene.extras.get<GasDescription>().evacuators = {
        {"", Vec3(10e-3, 0, 50e-3), 6e-3, 2e-4, {0.0, 10.0}}};
    set_steps(scene, steps);
    auto world = build(scene);
    ASSERT_TRUE(world);
    step_until(*world, 3.0);
    EXPECT_EQ(world->frame(), steps.steps_in(3.0));
    books[longer] = world->all<SmokeBody>()[0].volume.book();
    airborne[longer] = world->all<SmokeBody>()[0].volume.airborne();
    EXPECT_GT(books[longer].evacuated, 0.9 * books[longer].emitted);
  }
  EXPECT_NEAR(books[0].emitted, books[1].emitted, 1e-6 * books[0].emitted);
  EXPECT_NEAR(books[0].evacuated, books[1].evacuated, 0.005 * books[0].evacuated);
  EXPECT_NEAR(airborne[0], airborne[1], 0.01 * airborne[0]);
}

TEST(SmokeStages, WhatWasEmittedIsSomewhere) {
  EmitterDescription at_the_ball = steady(1e-6);
  at_the_ball.direction = -Vec3::UnitZ();
  at_the_ball.speed = 0.5;
  SceneDescription scene = smoking_scene({steady(2e-6), at_the_ball});
  scene.extras.get<SmokeDescriptions>()[0].lifetime = 0.8;
  scene.extras.get<GasDescription>().inlets = {
      {Vec3(-30e-3, 0, 60e-3), Vec3::UnitX(), 3e-3, 5e-5, {}}};
  scene.extras.get<GasDescription>().leaks = {{Vec3(35e-3, 35e-3, 80e-3), 1.3e-6}};
  scene.extras.get<GasDescription>().evacuators = {
      {"", Vec3(20e-3, 0, 40e-3), 6e-3, 2e-4, {1.0, 10.0}}};
  auto world = build(scene);
  ASSERT_TRUE(world);
  for (const double time : {0.5, 1.0, 1.5, 2.5}) {
    step_until(*world, time);
    const SmokeBody& smoke = world->all<SmokeBody>()[0];
    EXPECT_NEAR(sum_of(smoke), smoke.volume.book().emitted, 1e-9 * smoke.volume.book().emitted);
  }
  const SmokeBook& book = world->all<SmokeBody>()[0].volume.book();
  EXPECT_GT(book.background, 0.0);
  EXPECT_GT(book.evacuated, 0.0);
  EXPECT_GT(book.deposited, 0.0);
}

TEST(SmokeStages, SparksWarmTheGasByWhatTheGeneratorsBookSays) {
  SceneDescription scene = smoking_scene({});
  EmitterDescription at_hook;
  at_hook.instrument = "hook";
  scene.extras.get<SmokeDescriptions>()[0].emitters = {at_hook};
  scene.instruments = {straight_tool("hook", InstrumentKind::kHook, 1e-3,
                                     {{0.0, Vec3(0, 0, kRadius + 1.6e-3), 40.0, 1.0}})};
  scene.instruments[0].extras.set(CurrentMode::kFulgurate);
  auto world = build(scene);
  ASSERT_TRUE(world);
  step_until(*world, 1.0 / 60.0);
  // The tissue under them boils at once: that is the rest.
  const GasMixture mixture = gas_of(scene).mixture();
  double boiled = 0.0;
  for (const Puff& puff : puffs_of(world->all<OrganBurn>()[0].heat, mixture))
    boiled += puff.gas.heat;
  const double sparks = world->all<BurnTrace>()[0].book.gas;
  EXPECT_GT(sparks, 0.01 * boiled);
  EXPECT_NEAR(world->one<GasBody>()->grid->book().heat_given, sparks + boiled,
              1e-6 * (sparks + boiled));
}

TEST(SmokeStages, AnEvacuatorThatDrawsLeavesLessSmokeInTheAir) {
  const SceneDescription open = smoking_scene({steady(2e-6)});
  SceneDescription drawn = open;
  drawn.extras.get<GasDescription>().evacuators = {{"", Vec3(8e-3, 0, 45e-3), 8e-3, 4e-4, {}}};
  auto without = build(open), with = build(drawn);
  ASSERT_TRUE(without && with);
  step_until(*without, 1.5);
  step_until(*with, 1.5);
  EXPECT_LT(with->all<SmokeBody>()[0].volume.airborne(),
            0.7 * without->all<SmokeBody>()[0].volume.airborne());
  EXPECT_GT(with->all<SmokeBody>()[0].volume.book().evacuated, 0.0);
  EXPECT_EQ(without->all<SmokeBody>()[0].volume.book().evacuated, 0.0);
}

TEST(SmokeStages, AnEvacuatorDrawsAtTheTipOfItsInstrument) {
  SceneDescription scene = smoking_scene({steady(2e-6)});
  scene.instruments = {straight_tool("suction", InstrumentKind::kProbe, 1e-3,
                                     {{0.0, Vec3(6e-3, 0, kRadius + 20e-3), 0.0, 1.0}})};
  scene.extras.get<GasDescription>().evacuators = {{"suction", Vec3::Zero(), 8e-3, 3e-4, {}}};
  auto world = build(scene);
  ASSERT_TRUE(world);
  step_until(*world, 1.0);
  EXPECT_GT(world->all<SmokeBody>()[0].volume.book().evacuated, 0.0);
}

TEST(SmokeStages, NoParticleIsInsideAnOrgan) {
  EmitterDescription source = steady(2e-6);
  source.direction = -Vec3::UnitZ();  // at the ball
  source.speed = 0.5;
  source.excess = 0.0;
  auto world = build(smoking_scene({source}));
  ASSERT_TRUE(world);
  step_until(*world, 1.0);
  const SmokeBody& smoke = world->all<SmokeBody>()[0];
  ASSERT_GT(smoke.volume.particles().size(), 300u);
  // The drawn ball is a polyhedron, a little inside the sphere.
  for (std::size_t i = 0; i < smoke.volume.particles().size(); ++i) {
    const Vec3 at = world->all<SmokeSource>()[0].description.domain.min() +
                    smoke.volume.particles().position(i).cast<double>();
    EXPECT_GT(at.norm(), 0.985 * kRadius);
  }
}

TEST(SmokeStages, OrgansAreSolidToTheGasAndItRestsUntilThereIsSmoke) {
  EmitterDescription source = steady(2e-6);
  source.when.from = 0.3;
  SceneDescription scene = smoking_scene({source});
  scene.extras.get<GasDescription>().inlets = {
      {Vec3(-30e-3, 0, 60e-3), Vec3::UnitX(), 3e-3, 5e-5, {}}};
  auto world = build(scene);
  ASSERT_TRUE(world);
  step_until(*world, 0.25);
  EXPECT_TRUE(world->one<GasBody>()->grid->at_rest());
  step_until(*world, 0.6);
  const GasGrid& grid = *world->one<GasBody>()->grid;
  EXPECT_FALSE(grid.at_rest());
  int solid = 0;
  for (int k = 0; k < grid.cells()[2]; ++k)
    for (int j = 0; j < grid.cells()[1]; ++j)
      for (int i = 0; i < grid.cells()[0]; ++i) {
        const double r = grid.cell_middle(i, j, k).norm();
        if (r < 0.95 * kRadius) {
          EXPECT_TRUE(grid.is_solid(i, j, k));
        }
        if (r > 1.01 * kRadius) {
          EXPECT_FALSE(grid.is_solid(i, j, k));
        }
        solid += grid.is_solid(i, j, k);
      }
  EXPECT_GT(solid, 20);
}

TEST(SmokeStages, SmokeCarriesTheGasAlong) {
  auto world = build(smoking_scene({steady(2e-6)}));
  ASSERT_TRUE(world);
  step_until(*world, 1.0);
  // Above the source the warm plume rises, and the gas with it.
  EXPECT_GT(world->one<GasBody>()->grid->velocity(Vec3(0, 0, kRadius + 20e-3)).z(), 0.005);
}

TEST(SmokeStages, GasWithoutCellsStandsStillAndSmokeStillMoves) {
  SceneDescription scene = smoking_scene({steady(2e-6)});
  scene.extras.get<GasDescription>().cells = 0;
  auto world = build(scene);
  ASSERT_TRUE(world);
  EXPECT_FALSE(world->one<GasBody>()->grid);
  step_until(*world, 0.5);
  EXPECT_GT(world->all<SmokeBody>()[0].volume.particles().size(), 200u);
}

TEST(SmokeStages, VolumesMayOverlapAndEachHasItsEmitters) {
  SceneDescription scene = smoking_scene({steady(2e-6)});
  SmokeDescription second = scene.extras.get<SmokeDescriptions>()[0];
  second.name = "second";
  second.domain = Box(Vec3(-20e-3, -20e-3, 0), Vec3(60e-3, 40e-3, 80e-3));
  second.emitters[0].rate = 1e-6;
  second.emitters[0].position.x() = 10e-3;
  scene.extras.get<SmokeDescriptions>().push_back(second);
  auto world = build(scene);
  ASSERT_TRUE(world);
  step_until(*world, 0.5);
  const double first = world->all<SmokeBody>()[0].volume.book().emitted;
  EXPECT_NEAR(world->all<SmokeBody>()[1].volume.book().emitted, 0.5 * first, 0.02 * first);
}

TEST(SmokeStages, ManyThreadsGiveTheSameSmoke) {
  SceneDescription scene = smoking_scene({steady(2e-6)});
  scene.extras.get<GasDescription>().evacuators = {{"", Vec3(8e-3, 0, 45e-3), 8e-3, 4e-4, {}}};
  auto one = build(scene), other = build(scene);
  ASSERT_TRUE(one && other);
  step_until(*one, 0.8);
  {
    const oneapi::tbb::global_control single(oneapi::tbb::global_control::max_allowed_parallelism,
                                             1);
    step_until(*other, 0.8);
  }
  const SmokeParticles& a = one->all<SmokeBody>()[0].volume.particles();
  const SmokeParticles& b = other->all<SmokeBody>()[0].volume.particles();
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    EXPECT_EQ(a.ids[i], b.ids[i]);
    EXPECT_EQ(a.position(i), b.position(i));
  }
}

TEST(SmokeStages, VolumesBeyondTheMemoryAreRefusedWithTheirSize) {
  SceneDescription scene = smoking_scene({steady(2e-6)});
  scene.file = "scene.json";
  scene.extras.get<SmokeDescriptions>()[0].voxel = 2e-6;
  SceneModel model(scene, {}, all_features(), step_schedule());
  const Result<void> added = prepare_smoke(model);
  ASSERT_FALSE(added);
  EXPECT_NE(added.error().text().find("smoke/0 (\"plume\")"), std::string::npos);
  EXPECT_NE(added.error().text().find("80 % of this machine's memory"), std::string::npos);
}

TEST(SmokeStages, SmokeBetweenLensAndTipHidesIt) {
  SceneDescription scene = smoking_scene({steady(2e-5)});
  scene.instruments = {straight_tool("probe", InstrumentKind::kProbe, 1e-3,
                                     {{0.0, Vec3(0, 0, kRadius + 25e-3), 0.0, 1.0}})};
  auto world = build(scene);
  ASSERT_TRUE(world);
  CameraView camera;
  camera.position = Vec3(0, -0.1, kRadius + 25e-3);
  std::vector<ShownSmoke> shown;
  splat_smoke(*world, shown);
  EXPECT_EQ(sight_of_tips(*world, shown, camera), 1.0);
  step_until(*world, 1.5);
  splat_smoke(*world, shown);
  const std::optional<double> hidden = sight_of_tips(*world, shown, camera);
  ASSERT_TRUE(hidden);
  EXPECT_LT(*hidden, 0.9);
  EXPECT_GT(*hidden, 0.0);
}

}  // namespace
}  // namespace viscera::test
