#include <gtest/gtest.h>

#include "tests/engine/scene/scene_fixture.h"

namespace viscera::test {
namespace {

TEST(SceneOverride, ReplacesValuesByIndexAndByName) {
  SceneFolder folder;
  folder.options.overrides = {
      {"duration_s", "3"},           {"organs/0/resolution/finest_spacing_mm", "1.5"},
      {"organs/ball/tissue", "fat"}, {"instruments/burner/path/0/power_W", "55.5"},
      {"title", "with spaces"},      {"organs/liver/pose/position_mm", "[1, 2, 3]"}};
  const Result<SceneDescription> scene = folder.load(whole_scene());
  ASSERT_TRUE(scene) << scene.error().text();
  EXPECT_EQ(scene->duration, 3.0);
  EXPECT_EQ(scene->organs[0].resolution.finest, 0.0015);
  EXPECT_EQ(scene->organs[1].tissue, "fat");
  EXPECT_EQ(scene->instruments[1].path[0].power, 55.5);
  EXPECT_EQ(scene->title, "with spaces");
  EXPECT_TRUE(scene->organs[0].pose.position.isApprox(Vec3(0.001, 0.002, 0.003)));
}

TEST(SceneOverride, MakesObjectsThatTheFileLeavesOut) {
  SceneFolder folder;
  folder.options.overrides = {{"organs/ball/resolution/finest_spacing_mm", "2"},
                              {"light/intensity", "0"}};
  const Result<SceneDescription> scene = folder.load(least_scene());
  ASSERT_TRUE(scene) << scene.error().text();
  EXPECT_EQ(scene->organs[0].resolution.finest, 0.002);
  EXPECT_EQ(scene->light.intensity, 0.0);
}

TEST(SceneOverride, IsValidatedLikeTheFileAndNamed) {
  SceneFolder folder;
  folder.options.overrides = {{"duration", "3"},
                              {"duration_s", "nan"},
                              {"organs/ball/tissue", "rubbr"},
                              {"organs/0/resolution/spacing_mm", "-1"}};
  const std::vector<std::string> found = folder.mistakes(least_scene());
  EXPECT_EQ(found.size(), 4u);
  EXPECT_TRUE(mentions(found, "duration", {"duration_s", "(--set duration=3)"}));
  EXPECT_TRUE(mentions(found, "duration_s", {"the text \"nan\"", "(--set duration_s=nan)"}));
  EXPECT_TRUE(mentions(found, "organs/0/tissue",
                       {"did you mean \"rubber\"", "(--set organs/ball/tissue=rubbr)"}));
  EXPECT_TRUE(mentions(found, "organs/0/resolution/spacing_mm", {"-1", "--set"}));
}

TEST(SceneOverride, SaysWhereAPathLeadsNowhere) {
  SceneFolder folder;
  folder.options.overrides = {{"organs/bal/tissue", "fat"},
                              {"organs/7/tissue", "fat"},
                              {"name/x", "1"},
                              {"", "1"},
                              {"organs/-1", "1"}};
  const std::vector<std::string> found = folder.mistakes(least_scene());
  ASSERT_EQ(found.size(), 5u);
  EXPECT_EQ(found[0],
            "--set organs/bal/tissue=fat: found \"bal\", expected an index below 1 or a name: ball "
            "(did you mean \"ball\"?)");
  EXPECT_TRUE(found[1].find("found \"7\", expected an index below 1") != std::string::npos);
  EXPECT_EQ(found[2],
            "--set name/x=1: found the text \"least\" before \"x\", expected an object or a list");
  EXPECT_EQ(found[3], "--set =1: found no key, expected KEY/PATH=VALUE");
}

}  // namespace
}  // namespace viscera::test
