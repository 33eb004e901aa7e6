#include "engine/features/shafts/shafts_keys.h"

#include <gtest/gtest.h>

#include "tests/engine/scene/scene_fixture.h"

namespace viscera::test {
namespace {

TEST(ShaftsKeys, ArriveAndAreOffWhereNothingIsSaid) {
  const Result<SceneDescription> scene = SceneFolder().load(whole_scene());
  ASSERT_TRUE(scene) << scene.error().text();
  EXPECT_TRUE(shafts_of(*scene).touch);
  EXPECT_DOUBLE_EQ(shafts_of(*scene).endoscope_radius, 4e-3);
  EXPECT_TRUE(shafts_of(*scene).tools);
  Json silent = whole_scene();
  silent.erase("contact");
  const Result<SceneDescription> without = SceneFolder().load(silent);
  ASSERT_TRUE(without) << without.error().text();
  EXPECT_FALSE(shafts_of(*without).touch);
  EXPECT_FALSE(shafts_of(*without).tools);
}

TEST(ShaftsKeys, ABarrelThatIsTooWideAndAWordInPlaceOfTrueAreRefusedWithTheirPlace) {
  EXPECT_ONE_MISTAKE(mistakes_with("/contact/endoscope_radius_mm", 25),
                     "contact/endoscope_radius_mm", "found 25, expected a number from 0 to 10");
  EXPECT_ONE_MISTAKE(mistakes_with("/contact/shafts", "all"), "contact/shafts", "found");
}

}  // namespace
}  // namespace viscera::test
