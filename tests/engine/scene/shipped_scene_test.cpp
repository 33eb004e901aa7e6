#include <gtest/gtest.h>

#include <map>
#include <regex>
#include <sstream>

#include "engine/features/features.h"
#include "engine/features/gravity/gravity_keys.h"
#include "engine/scene/load_scene.h"
#include "tests/support/paths.h"

namespace viscera::test {
namespace {

Result<SceneDescription> load_shipped(const std::string& name,
                                      std::vector<std::filesystem::path> search = {}) {
  SceneLoadOptions options;
  options.assets = project_file("assets");
  options.features = feature_keys();
  options.search = std::move(search);
  return load_scene(project_file("scenes/" + name + ".json"), options);
}

class ShippedScene : public testing::TestWithParam<const char*> {};

TEST_P(ShippedScene, Loads) {
  const Result<SceneDescription> scene = load_shipped(GetParam());
  ASSERT_TRUE(scene) << scene.error().text();
  EXPECT_EQ(scene->name, GetParam());
  EXPECT_TRUE(scene->camera);
  EXPECT_FALSE(scene->title.empty());
}

INSTANTIATE_TEST_SUITE_P(All, ShippedScene,
                         testing::Values("laparoscopic_cautery", "kidney_palpation",
                                         "lung_palpation", "sphere_press", "hemisphere",
                                         "tilted_table", "kidney_rubbed", "liver_deep_palpation",
                                         "liver_retraction", "gallbladder_lift", "retraction",
                                         "incision", "sever", "seal", "retrieval", "cutting_hook"),
                         [](const auto& scene) { return std::string(scene.param); });

/// Scenes that load without data of others.
std::vector<SceneDescription> shipped_scenes() {
  std::vector<SceneDescription> scenes;
  for (const auto& file : std::filesystem::directory_iterator(project_file("scenes"))) {
    const std::string name = file.path().stem().string();
    if (name == "scene.schema" || name == "visible_human_cautery" || name == "label_map_palpation")
      continue;
    auto scene = load_shipped(name);
    if (scene)
      scenes.push_back(*std::move(scene));
    else
      ADD_FAILURE() << name << ": " << scene.error().text();
  }
  return scenes;
}

TEST(ShippedScenes, ShowGravityFrictionFiniteStrainsAndMeshTips) {
  bool gravity = false, friction = false, finite = false, mesh = false;
  for (const SceneDescription& scene : shipped_scenes()) {
    gravity |= gravity_of(scene) != nullptr;
    for (const InstrumentDescription& tool : scene.instruments) {
      friction |= tool.friction > 0.0;
      mesh |= tool.tip.shape == TipDescription::Shape::kMesh;
    }
    for (const OrganDescription& organ : scene.organs)
      finite |= organ.material.model != HyperelasticModel::kLinear;
  }
  EXPECT_TRUE(gravity);
  EXPECT_TRUE(friction);
  EXPECT_TRUE(finite);
  EXPECT_TRUE(mesh);
}

TEST(ShippedScenes, TheGuideSaysWhichOrgansOfEachDeform) {
  // Rows such as: | `a`, `b` | what | 1 of 2: liver; 1 of 1: ball |
  std::map<std::string, std::string> told;
  std::istringstream guide(file_text(project_file("docs/guide.md")));
  const std::regex row(R"(\| ((?:`\w+`(?:, )?)+) \| .* \| ([^|]*\d of \d[^|]*) \|)"),
      name(R"(\w+)");
  for (std::string line; std::getline(guide, line);) {
    std::smatch parts;
    if (!std::regex_match(line, parts, row)) continue;
    const std::string names = parts[1];
    std::istringstream organs(parts[2]);
    for (std::sregex_iterator at(names.begin(), names.end(), name), end; at != end; ++at) {
      std::string one;
      std::getline(organs >> std::ws, one, ';');
      told[at->str()] = one;
    }
  }
  for (const SceneDescription& scene : shipped_scenes()) {
    std::string names;
    std::size_t count = 0;
    for (const OrganDescription& organ : scene.organs)
      if (organ.deformable) names += (count++ > 0 ? ", " : "") + organ.name;
    EXPECT_EQ(told[scene.name],
              std::to_string(count) + " of " + std::to_string(scene.organs.size()) + ": " + names)
        << scene.name;
  }
}

TEST(ShippedScenes, TheVisibleHumanLoadsWithItsData) {
  const auto data = shared_data("visible_human/VH_M_Liver.glb");
  if (!data) GTEST_SKIP() << "the data folder is absent";
  const Result<SceneDescription> scene =
      load_shipped("visible_human_cautery", {data->parent_path().parent_path()});
  ASSERT_TRUE(scene) << scene.error().text();
  EXPECT_EQ(scene->organs.size(), 4u);
}

TEST(ShippedScenes, TheVisibleHumanSaysWhereItSoughtItsData) {
  const Result<SceneDescription> scene = load_shipped("visible_human_cautery");
  ASSERT_FALSE(scene);
  EXPECT_EQ(scene.error().messages.size(), 3u) << scene.error().text();
  EXPECT_NE(scene.error().text().find("organs/0/geometry/file: found no file \"VH_M_Liver.glb\", "
                                      "expected it in one of "),
            std::string::npos)
      << scene.error().text();
}

}  // namespace
}  // namespace viscera::test
