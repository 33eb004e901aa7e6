#include "engine/run/observers/trainee.h"

#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>

#include "engine/features/beds/beds.h"
#include "engine/features/cautery/cautery.h"
#include "engine/simulator/build.h"
#include "tests/support/lifted_block.h"
#include "tests/support/small_world.h"

namespace viscera::test {
namespace {

constexpr double kTop = 25e-3;

/// The motion of least jerk over `way` [m] in `span` [s], with a tremor of this amplitude [m].
Motion reach(double way, double span, double tremor) {
  Motion motion;
  const int steps = static_cast<int>(std::lround(60.0 * span));
  for (int i = 0; i <= steps; ++i) {
    // Frames end at whole milliseconds, so they aren't evenly apart.
    const double time = std::floor(1000.0 * i / 60.0) / 1000.0, t = time / span;
    const double along = way * t * t * t * (10.0 + t * (-15.0 + 6.0 * t));
    motion.add(time, Vec3(along, tremor * std::sin(2.0 * std::numbers::pi * 8.0 * time), 0.0));
  }
  return motion;
}

TEST(Motion, LeastJerkHasTheSmoothnessOfTheClosedForm) {
  // The integral of jerk^2 is 720 D^2 / T^5, the greatest speed 15/8 D / T.
  const double exact = -std::log(720.0 / std::pow(15.0 / 8.0, 2));
  const Motion motion = reach(0.1, 2.0, 0.0);
  ASSERT_TRUE(motion.smoothness());
  EXPECT_NEAR(*motion.smoothness(), exact, 0.1);
  EXPECT_NEAR(motion.path(), 0.1, 1e-4);
}

TEST(Motion, SmoothnessDoesNotDependOnSizeOrPace) {
  EXPECT_NEAR(*reach(0.1, 2.0, 0.0).smoothness(), *reach(0.01, 4.0, 0.0).smoothness(), 0.1);
}

TEST(Motion, TremorIsLessSmooth) {
  EXPECT_LT(*reach(0.1, 2.0, 1e-3).smoothness(), *reach(0.1, 2.0, 0.0).smoothness() - 2.0);
}

TEST(Motion, WhatNeverMovedHasNone) {
  Motion motion;
  for (int i = 0; i < 100; ++i) motion.add(i / 60.0, Vec3(1, 2, 3));
  EXPECT_FALSE(motion.smoothness());
  EXPECT_EQ(motion.path(), 0.0);
}

/// A hook with current that comes down on a ball's pole.
SceneDescription burning_scene() {
  auto scene = soft_ball_scene(6e-3, 4e-3);
  scene.instruments = {straight_tool("hook", InstrumentKind::kHook, 1e-3,
                                     {{0.0, Vec3(0, 0, kTop + 6e-3), 30.0, 1.0},
                                      {0.5, Vec3(0, 0, kTop + 0.2e-3), 30.0, 1.0},
                                      {1.0, Vec3(0, 0, kTop + 0.2e-3), 30.0, 1.0}})};
  return scene;
}

struct Watched {
  TraineeFigures trainee;
  std::optional<CauteryFigures> cautery;
  Json report;
};

Watched watch(const SceneDescription& scene, double time) {
  auto world = build(scene);
  if (!world) return {};
  Trainee trainee(*world, scene);
  Trace trace(stage_names());
  while (world->time() < time) {
    step_frame(*world, trace);
    trainee.add_frame(*world);
  }
  RunReport report;
  trainee.describe(*world, report);
  return {trainee.figures(*world), cautery_figures(*world), Json::parse(to_json(report))};
}

TEST(Trainee, EnergyHeatAndForcesAreTold) {
  const auto [trainee, cautery, report] = watch(burning_scene(), 1.0);
  ASSERT_TRUE(cautery);
  EXPECT_GT(cautery->delivered, 3.0);
  EXPECT_EQ(trainee.energy, cautery->delivered);
  EXPECT_GT(trainee.idle_current, 0.2) << "on the way down";
  EXPECT_LT(trainee.idle_current, 0.5);
  EXPECT_GT(*trainee.greatest_temperature, 373.0);
  ASSERT_EQ(trainee.organs.size(), 1u);
  EXPECT_GT(trainee.organs[0].peak_force, 0.0);
  EXPECT_LE(trainee.organs[0].mean_force, trainee.organs[0].peak_force);
  EXPECT_LT(trainee.organs[0].touched, 0.8);
  ASSERT_EQ(trainee.tips.size(), 1u);
  EXPECT_NEAR(trainee.tips[0].path, 5.8e-3, 1e-4);
}

TEST(Trainee, HasASectionOfTheReport) {
  const auto [trainee, cautery, report] = watch(burning_scene(), 0.3);
  const Json& section = report["trainee"];
  EXPECT_EQ(section["current_without_contact_s"], trainee.idle_current);
  EXPECT_TRUE(section["organs"].empty()) << "it is still on its way";
  EXPECT_EQ(section["tips"][0]["name"], "hook");
  EXPECT_EQ(section["tips"][0]["path_length_m"], trainee.tips[0].path);
  EXPECT_TRUE(section["spared_organs_burnt"].is_array());
  EXPECT_TRUE(section["time_in_smoke_s"].is_null()) << "nobody looks through smoke";
}

TEST(Trainee, BurningASparedOrganIsAMistakeBurningAnotherIsNot) {
  auto scene = burning_scene();
  EXPECT_TRUE(watch(scene, 1.0).trainee.spared_burns.empty());
  scene.organs[0].extras.set(Spared());
  const Watched seen = watch(scene, 1.0);
  ASSERT_EQ(seen.trainee.spared_burns.size(), 1u);
  EXPECT_EQ(seen.trainee.spared_burns[0].organ, scene.organs[0].name);
  EXPECT_GT(seen.trainee.spared_burns[0].coagulated, 0.0);
  EXPECT_GT(seen.trainee.spared_burns[0].dead, seen.trainee.spared_burns[0].coagulated);
  EXPECT_EQ(seen.report["trainee"]["spared_organs_burnt"][0]["organ"], scene.organs[0].name);
}

TEST(Trainee, WhatIsTornOffABedIsToldWhatIsBurntOffIsNot) {
  const auto scene = lifted_block({});
  auto world = build(scene);
  ASSERT_TRUE(world);
  const Trainee trainee(*world, scene);
  BondStates& bonds = world->all<BedState>()[0].bonds;
  bonds.parted_by[0] = bonds.parted_by[1] = 1;
  EXPECT_TRUE(trainee.figures(*world).torn_beds.empty());
  bonds.opened[2] = 1.0;
  const std::vector<double>& areas = world->all<Bed>()[0].places.layer.areas;
  RunReport report;
  trainee.describe(*world, report);
  const Json torn = Json::parse(to_json(report))["trainee"]["beds_torn"];
  ASSERT_EQ(torn.size(), 1u);
  EXPECT_EQ(torn[0]["bed"], "bed");
  EXPECT_EQ(torn[0]["bonds"], 1);
  EXPECT_EQ(torn[0]["area_m2"], areas[2]);
}

TEST(Trainee, WithoutAHookThereIsNoBook) {
  auto scene = burning_scene();
  scene.instruments[0].kind = InstrumentKind::kProbe;
  for (InstrumentKey& key : scene.instruments[0].path) key.power = 0.0;
  const Watched seen = watch(scene, 0.3);
  EXPECT_FALSE(seen.cautery);
  EXPECT_EQ(seen.trainee.idle_current, 0.0);
  EXPECT_FALSE(seen.trainee.greatest_temperature);
}

}  // namespace
}  // namespace viscera::test
