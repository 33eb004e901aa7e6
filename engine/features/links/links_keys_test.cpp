#include "engine/features/links/links_keys.h"

#include <gtest/gtest.h>

#include "tests/engine/scene/scene_fixture.h"

namespace viscera::test {
namespace {

TEST(LinksKeys, ArriveInSiUnits) {
  const Result<SceneDescription> scene = SceneFolder().load(whole_scene());
  ASSERT_TRUE(scene) << scene.error().text();
  const std::span<const LinkDescription> links = links_of(*scene);
  ASSERT_EQ(links.size(), 2u);
  EXPECT_EQ(links[0].between, (std::array<std::string, 2>{"liver", "ball"}));
  EXPECT_EQ(links[0].stiffness, 200.0);
  EXPECT_EQ(links[0].region.radius, 0.004);
  EXPECT_EQ(links[1].between[0], LinkDescription::kGround);
  EXPECT_TRUE(links[1].region.contains(Vec3(0.001, -0.002, 0.003)));
}

TEST(LinksKeys, AreSetByTheLinksName) {
  SceneFolder folder;
  folder.options.overrides = {{"links/bed/stiffness_N_per_m", "30"}};
  const Result<SceneDescription> scene = folder.load(whole_scene());
  ASSERT_TRUE(scene) << scene.error().text();
  EXPECT_EQ(links_of(*scene)[0].stiffness, 30.0);
}

TEST(LinksKeys, TieTwoKnownOrgansOfWhichOneDeforms) {
  EXPECT_ONE_MISTAKE(mistakes_with("/links/0/between/1", "bal"), "links/0/between/1",
                     "found the text \"bal\", expected the name of an organ: one of ground, liver",
                     "did you mean \"ball\"");
  EXPECT_ONE_MISTAKE(mistakes_with("/links/0/between", {"liver"}), "links/0/between",
                     "expected an array of 2 names of organs");
  EXPECT_ONE_MISTAKE(mistakes_with("/links/0/between", {"liver", 3}), "links/0/between",
                     "expected an array of 2 names of organs");
  EXPECT_ONE_MISTAKE(mistakes_with("/links/0/between/1", "liver"), "links/0/between/1",
                     "found \"liver\" again, expected another than between/0");
  EXPECT_ONE_MISTAKE(mistakes_with("/links/0/between/0", "brick"), "links/0/between",
                     "found [\"brick\",\"ball\"], expected at least one deformable organ");
  EXPECT_ONE_MISTAKE(mistakes_with("/links/0/stiffness_N_per_m", -5), "links/0/stiffness_N_per_m",
                     "found -5, expected a number from 0 to 1000000000");
  EXPECT_ONE_MISTAKE(mistakes_with("/links/0/stiffness_N_per_mm", 5), "links/0/stiffness_N_per_mm",
                     "found");
  EXPECT_ONE_MISTAKE(mistakes_with("/links/0/region/half_space", 3), "links/0/region/half_space",
                     "found an unknown key, expected one of");
  EXPECT_ONE_MISTAKE(mistakes_with("/links/1/name", "bed"), "links/1/name", "again");
  EXPECT_ONE_MISTAKE(mistakes_with("/organs/2/name", "ground"), "organs/2/name",
                     "found \"ground\", expected another name");
}

}  // namespace
}  // namespace viscera::test
