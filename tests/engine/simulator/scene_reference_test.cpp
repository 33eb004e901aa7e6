// docs/scene.md and scenes/scene.schema.json tell every key of the simulator, those of features
// too.
#include "engine/scene/scene_reference.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <sstream>

#include "engine/features/features.h"
#include "engine/scene/load_scene.h"
#include "tests/support/paths.h"

namespace viscera::test {
namespace {

/// The file is what was made; with VISCERA_UPDATE_SCHEMA=1 it becomes that.
void expect_published(const std::filesystem::path& file, const std::string& made) {
  if (std::getenv("VISCERA_UPDATE_SCHEMA")) std::ofstream(file, std::ios::binary) << made;
  std::ostringstream published;
  published << std::ifstream(file, std::ios::binary).rdbuf();
  EXPECT_EQ(published.str(), made)
      << file.string() << " is out of date; run this test with VISCERA_UPDATE_SCHEMA=1";
}

TEST(SceneReference, ThePublishedPageIsMadeFromTheTableOfKeysAndFeatures) {
  expect_published(project_file("docs/scene.md"), scene_reference(feature_keys()));
}

TEST(SceneSchema, ThePublishedFileIsTheLoadersOwnTableWithTheFeaturesKeys) {
  expect_published(project_file("scenes/scene.schema.json"), scene_schema(feature_keys()));
}

}  // namespace
}  // namespace viscera::test
