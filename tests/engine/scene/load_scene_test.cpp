#include "engine/scene/load_scene.h"

#include <gtest/gtest.h>

#include <numbers>

#include "tests/engine/scene/scene_fixture.h"

namespace viscera::test {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;

TEST(LoadScene, EveryKeyArrivesInSiUnits) {
  const SceneFolder folder;
  const Result<SceneDescription> loaded = folder.load(whole_scene());
  ASSERT_TRUE(loaded) << loaded.error().text();
  const SceneDescription& scene = *loaded;
  EXPECT_EQ(scene.file, folder.path() / "scene.json");
  EXPECT_EQ(scene.name, "whole");
  EXPECT_EQ(scene.title, "Every key");
  EXPECT_EQ(scene.duration, 4.0);
  EXPECT_EQ(scene.seed, 7u);
  EXPECT_EQ(scene.steps.per_second, 120u);
  for (const OrganDescription& organ : scene.organs) EXPECT_EQ(organ.finite.time_step, 1.0 / 120.0);

  ASSERT_EQ(scene.organs.size(), 4u);
  const OrganDescription& liver = scene.organs[0];
  const auto& recipe = std::get<RecipeGeometry>(liver.geometry);
  EXPECT_EQ(recipe.recipe, "liver");
  EXPECT_EQ(recipe.seed, 3u);
  EXPECT_EQ(recipe.edge, 0.004);
  EXPECT_EQ(recipe.scale, 1.5);
  EXPECT_FALSE(recipe.triangles);
  EXPECT_EQ(liver.youngs_modulus, 6000.0);
  EXPECT_EQ(liver.poisson_ratio, 0.4);
  EXPECT_EQ(liver.resolution.spacing, 0.01);
  EXPECT_EQ(liver.resolution.finest, 0.0025);
  EXPECT_EQ(liver.resolution.gradient, 0.3);
  EXPECT_EQ(std::get<RecipeGeometry>(scene.organs[1].geometry).triangles, 500);
  EXPECT_EQ(std::get<RecipeGeometry>(scene.organs[1].geometry).radius, 0.025);
  EXPECT_TRUE(
      std::get<RecipeGeometry>(scene.organs[2].geometry).size.isApprox(Vec3(0.01, 0.02, 0.03)));
  const auto& file = std::get<FileGeometry>(scene.organs[3].geometry);
  EXPECT_EQ(file.file, folder.path() / "ball.obj");
  EXPECT_EQ(file.unit, 0.01);
  EXPECT_EQ(file.edge, 0.002);
  EXPECT_TRUE(file.recentre);
  ASSERT_TRUE(file.wrap);
  EXPECT_DOUBLE_EQ(file.wrap->voxel, 1.5e-3);
  EXPECT_DOUBLE_EQ(file.wrap->close, 4e-3);
  EXPECT_FALSE(scene.organs[3].deformable);

  const InstrumentDescription& holder = scene.instruments.at(0);
  EXPECT_EQ(holder.kind, InstrumentKind::kGrasper);
  EXPECT_EQ(holder.tip.shape, TipDescription::Shape::kCapsule);
  EXPECT_EQ(holder.tip.radius, 0.002);
  EXPECT_EQ(holder.tip.length, 0.012);
  EXPECT_EQ(holder.trocar, Vec3(0, 0, 0.2));
  EXPECT_EQ(holder.shaft_radius, 0.003);
  EXPECT_DOUBLE_EQ(holder.roll, std::numbers::pi / 2);
  EXPECT_EQ(holder.grip_limit, 5.0);
  EXPECT_EQ(holder.grip_radius, 0.003);
  EXPECT_EQ(liver.response, Response::kLocal);
  EXPECT_EQ(scene.organs[1].response, Response::kAuto);
  ASSERT_EQ(holder.path.size(), 2u);
  EXPECT_EQ(holder.path[1].time, 1.5);
  EXPECT_EQ(holder.path[1].tip, Vec3(0, 0, 0.09));
  EXPECT_EQ(holder.path[1].jaw, 0.0);
  EXPECT_EQ(scene.instruments.at(1).path[0].power, 30.0);
  EXPECT_EQ(scene.instruments.at(1).tip.file, folder.path() / "ball.obj");
  EXPECT_EQ(scene.instruments.at(1).tip.unit, 1.0);

  ASSERT_TRUE(scene.camera);
  EXPECT_DOUBLE_EQ(scene.camera->optics, 30 * kDegree);
  EXPECT_DOUBLE_EQ(scene.camera->field_of_view, 60 * kDegree);
  EXPECT_FALSE(scene.camera->round_mask);
  EXPECT_DOUBLE_EQ(scene.camera->path.at(0).roll, std::numbers::pi);
  EXPECT_EQ(scene.light.intensity, 2.0);
  EXPECT_EQ(scene.light.colour_temperature, 5000.0);
}

TEST(LoadScene, StepsEndAtWholeMillisecondsAndAsManyAsTheSecondHas) {
  for (const std::uint64_t rate : {30, 60, 120, 240}) {
    const StepRate steps{.per_second = rate};
    EXPECT_EQ(steps.last_tick(rate), 1000u);
    EXPECT_EQ(steps.last_tick(1), 1000 / rate);
    EXPECT_EQ(steps.steps_in(2.0), 2 * rate);
    EXPECT_EQ(steps.steps_covering(1.0 + 0.1 / static_cast<double>(rate)), rate + 1);
  }
}

TEST(LoadScene, RotationsGoAboutFixedAxesXThenYThenZ) {
  const SceneFolder folder;
  const Result<SceneDescription> scene = folder.load(whole_scene());  // 90 about x, then 90 about z
  ASSERT_TRUE(scene) << scene.error().text();
  const Pose& pose = scene->organs[0].pose;
  // y turns to z about x, and z stays where it is about z; x turns to y about z.
  EXPECT_TRUE(pose.direction_to_world(Vec3::UnitY()).isApprox(Vec3::UnitZ()));
  EXPECT_TRUE(pose.direction_to_world(Vec3::UnitX()).isApprox(Vec3::UnitY()));
  EXPECT_TRUE(pose.to_world(Vec3::Zero()).isApprox(Vec3(0.01, 0.02, 0.03)));
}

TEST(LoadScene, RegionsHoldWhatTheySay) {
  const SceneFolder folder;
  const Result<SceneDescription> scene = folder.load(whole_scene());
  ASSERT_TRUE(scene) << scene.error().text();
  const std::vector<Region>& fixed = scene->organs[0].fixed;
  ASSERT_EQ(fixed.size(), 3u);
  EXPECT_TRUE(fixed[0].contains(Vec3(9, 9, 0.0049)));
  EXPECT_FALSE(fixed[0].contains(Vec3(9, 9, 0.0051)));
  EXPECT_DOUBLE_EQ(fixed[0].b.norm(), 1.0);
  EXPECT_TRUE(fixed[1].contains(Vec3(0.001, 0.002, 0.0069)));
  EXPECT_FALSE(fixed[1].contains(Vec3(0.001, 0.002, 0.0071)));
  EXPECT_TRUE(fixed[2].contains(Vec3(0.001, -0.002, 0.003)));
  EXPECT_FALSE(fixed[2].contains(Vec3(0.0011, 0, 0)));
}

TEST(LoadScene, WhatTheFileLeavesOutIsAsInTheStructures) {
  const SceneFolder folder;
  Json text = least_scene();
  text["instruments"] = Json::parse(R"([{"name": "p", "kind": "probe", "trocar_mm": [0, 0, 200],
      "path": [{"time_s": 0, "tip_mm": [0, 0, 100]}]},
      {"name": "g", "kind": "grasper", "trocar_mm": [0, 0, 200],
      "path": [{"time_s": 0, "tip_mm": [0, 0, 100]}]}])");
  text["camera"] = Json::parse(R"({"path": [{"time_s": 0, "tip_mm": [0, -9, 0],
      "target_mm": [0, 0, 0]}]})");
  const Result<SceneDescription> scene = folder.load(text);
  ASSERT_TRUE(scene) << scene.error().text();
  const SceneDescription plain;
  EXPECT_EQ(scene->duration, plain.duration);
  EXPECT_EQ(scene->seed, plain.seed);
  EXPECT_EQ(scene->steps.per_second, plain.steps.per_second);
  EXPECT_EQ(scene->light.intensity, plain.light.intensity);
  EXPECT_EQ(scene->light.colour_temperature, plain.light.colour_temperature);
  const OrganDescription organ;
  EXPECT_EQ(scene->organs[0].formulation, organ.formulation);
  EXPECT_EQ(scene->organs[0].deformable, organ.deformable);
  EXPECT_DOUBLE_EQ(scene->organs[0].resolution.spacing, organ.resolution.spacing);
  EXPECT_DOUBLE_EQ(scene->organs[0].resolution.finest, organ.resolution.finest);
  EXPECT_EQ(scene->organs[0].resolution.gradient, organ.resolution.gradient);
  const InstrumentDescription instrument;
  EXPECT_EQ(scene->instruments[0].tip.shape, instrument.tip.shape);
  EXPECT_DOUBLE_EQ(scene->instruments[0].tip.radius, instrument.tip.radius);
  EXPECT_DOUBLE_EQ(scene->instruments[0].shaft_radius, instrument.shaft_radius);
  EXPECT_DOUBLE_EQ(scene->instruments[1].grip_limit, instrument.grip_limit);
  EXPECT_DOUBLE_EQ(scene->instruments[1].grip_radius, instrument.grip_radius);
  EXPECT_EQ(scene->instruments[0].path[0].power, InstrumentKey().power);
  EXPECT_EQ(scene->instruments[0].path[0].jaw, InstrumentKey().jaw);
  EXPECT_EQ(scene->camera->optics, CameraDescription().optics);
  EXPECT_NEAR(scene->camera->field_of_view, CameraDescription().field_of_view, 1e-4);
  EXPECT_EQ(scene->camera->round_mask, CameraDescription().round_mask);
}

TEST(LoadScene, PowerThatCannotBeIsRefused) {
  const SceneFolder folder;
  for (const double power : {-5.0, 1e4}) {
    Json scene = whole_scene();
    scene["instruments"][1]["path"][0]["power_W"] = power;
    const std::vector<std::string> mistakes = folder.mistakes(scene);
    ASSERT_EQ(mistakes.size(), 1u) << power;
    EXPECT_NE(mistakes[0].find("instruments/1/path/0/power_W"), std::string::npos) << mistakes[0];
    EXPECT_NE(mistakes[0].find("expected a number from 0 to 400"), std::string::npos)
        << mistakes[0];
  }
}

TEST(LoadScene, TheCameraMayBeLeftOut) {
  const Result<SceneDescription> scene = SceneFolder().load(least_scene());
  ASSERT_TRUE(scene) << scene.error().text();
  EXPECT_FALSE(scene->camera);
}

TEST(LoadScene, GeometryIsFoundInExtraFoldersAndTheirSubfolders) {
  SceneFolder folder;
  folder.write("data/hearts/heart.stl", "solid\n");
  folder.write("assets/own.glb", "x");
  folder.options.search = {folder.path() / "data"};
  Json scene = whole_scene();
  scene["organs"][3]["geometry"]["file"] = "heart.stl";
  scene["instruments"][1]["tip"]["file"] = "own.glb";
  const Result<SceneDescription> loaded = folder.load(scene);
  ASSERT_TRUE(loaded) << loaded.error().text();
  EXPECT_EQ(std::get<FileGeometry>(loaded->organs[3].geometry).file,
            folder.path() / "data/hearts/heart.stl");
  EXPECT_EQ(loaded->instruments[1].tip.file, folder.path() / "assets/own.glb");
}

}  // namespace
}  // namespace viscera::test
