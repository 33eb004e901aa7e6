#include "engine/features/clips/clips_keys.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "tests/engine/scene/scene_fixture.h"

namespace viscera::test {
namespace {

TEST(ClipsKeys, ArriveInMetresAndPascalsAndOnlyWhereTheyStand) {
  const auto scene = SceneFolder().load(whole_scene());
  ASSERT_TRUE(scene) << scene.error().text();
  const auto tool = std::ranges::find(scene->instruments, "clipper", &InstrumentDescription::name);
  ASSERT_NE(tool, scene->instruments.end());
  EXPECT_EQ(tool->kind, InstrumentKind::kClipApplier);
  const ClipsDescription* clips = clips_of(*tool);
  ASSERT_TRUE(clips);
  EXPECT_EQ(clips->count, 3);
  EXPECT_DOUBLE_EQ(clips->length, 8e-3);
  EXPECT_DOUBLE_EQ(clips->width, 1.5e-3);
  EXPECT_DOUBLE_EQ(clips->opening, 7e-3);
  EXPECT_DOUBLE_EQ(clips->gap, 0.4e-3);
  EXPECT_DOUBLE_EQ(clips->holds, 50e3);
  EXPECT_FALSE(clips_of(scene->instruments[0]));
  const auto organ = std::ranges::find(scene->organs, "brick", &OrganDescription::name);
  ASSERT_NE(organ, scene->organs.end());
  const auto ducts = ducts_of(*organ);
  ASSERT_EQ(ducts.size(), 1u);
  EXPECT_EQ(ducts[0].name, "vein");
  ASSERT_EQ(ducts[0].path.size(), 2u);
  EXPECT_DOUBLE_EQ(ducts[0].path[1].z(), 14e-3);
  EXPECT_DOUBLE_EQ(ducts[0].pressure, 1.5e3);
  EXPECT_EQ(ducts[0].fed, DuctDescription::Fed::kEnd);
  EXPECT_TRUE(ducts_of(scene->organs[0]).empty());
}

TEST(ClipsKeys, OfClipsThatAreNoneAndDuctsOfOnePointAreRefusedWithTheirPlace) {
  EXPECT_ONE_MISTAKE(mistakes_with("/instruments/2/clip_mm", 8), "instruments/2/clip_mm", "found 8",
                     "kind");
  EXPECT_ONE_MISTAKE(mistakes_with("/instruments/4/clips", 0), "instruments/4/clips", "found 0",
                     "expected a whole number from 1 to 20");
  EXPECT_ONE_MISTAKE(mistakes_with("/organs/2/ducts/0/fed_from", "middle"),
                     "organs/2/ducts/0/fed_from", "middle", "start");
  EXPECT_ONE_MISTAKE(
      mistakes_with("/organs/2/ducts/0/through", Json::array({{{"point_mm", {0, 0, 0}}}})),
      "organs/2/ducts/0/through", "an array of 1", "2 to 1000");
}

}  // namespace
}  // namespace viscera::test
