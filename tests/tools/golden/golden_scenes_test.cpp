// What the shipped scenes come to is what was written down (tests/scenes/golden.json).
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>

#include "tests/support/paths.h"
#include "tools/golden/golden.h"

namespace viscera::test {
namespace {

std::vector<std::string> scene_names() {
  const auto scenes = read_golden(project_file("tests/scenes/golden.json"));
  std::vector<std::string> names;
  if (scenes)
    for (const GoldenScene& scene : *scenes) names.push_back(scene.name);
  return names;
}

class ShippedScene : public testing::TestWithParam<std::string> {};

TEST_P(ShippedScene, ComesToItsGoldenFigures) {
  setenv("VISCERA_CACHE", VISCERA_GOLDEN_CACHE, 1);
  const auto scenes = read_golden(project_file("tests/scenes/golden.json"));
  ASSERT_TRUE(scenes) << scenes.error().text();
  for (const GoldenScene& scene : *scenes) {
    if (scene.name != GetParam()) continue;
    EXPECT_GE(scene.figures.size(), 3u);
    const TemporaryFolder folder;
    const auto found = golden_run(scene, project_file("."), folder / "out");
    ASSERT_TRUE(found) << found.error().text();
    for (const GoldenChange& change : golden_changes(scene, *found)) {
      EXPECT_FALSE(change.beyond)
          << change.line << "\nWhere that is meant: build/release/tools/golden/viscera_golden "
          << "--write, and say in the change what moved these figures.";
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Golden, ShippedScene, testing::ValuesIn(scene_names()),
                         [](const auto& scene) { return scene.param; });

TEST(GoldenFile, HasEveryShippedSceneThatNeedsNoOthersData) {
  const std::vector<std::string> names = scene_names();
  std::size_t shipped = 0;
  for (const auto& entry : std::filesystem::directory_iterator(project_file("scenes"))) {
    const std::string name = entry.path().stem().string();
    if (name == "scene.schema" || name == "label_map_palpation" || name == "visible_human_cautery")
      continue;
    ++shipped;
    EXPECT_NE(std::find(names.begin(), names.end(), name), names.end()) << name;
  }
  EXPECT_EQ(names.size(), shipped);
}

}  // namespace
}  // namespace viscera::test
