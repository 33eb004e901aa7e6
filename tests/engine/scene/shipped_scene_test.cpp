#include <gtest/gtest.h>

#include "engine/features/features.h"
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
                                         "lung_palpation", "sphere_press", "hemisphere"),
                         [](const auto& scene) { return std::string(scene.param); });

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
