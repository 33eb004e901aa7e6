#include "engine/features/touching/touching_keys.h"

#include <gtest/gtest.h>

#include "tests/engine/scene/scene_fixture.h"

namespace viscera::test {
namespace {

TEST(TouchingKeys, ArriveAndAreOffWhereNothingIsSaid) {
  const Result<SceneDescription> scene = SceneFolder().load(whole_scene());
  ASSERT_TRUE(scene) << scene.error().text();
  EXPECT_TRUE(touching_of(*scene).organs);
  EXPECT_EQ(touching_of(*scene).friction, 0.2);
  EXPECT_EQ(touching_of(*scene).pitch, 1.5);
  Json silent = whole_scene();
  silent.erase("contact");
  const Result<SceneDescription> without = SceneFolder().load(silent);
  ASSERT_TRUE(without) << without.error().text();
  EXPECT_FALSE(touching_of(*without).organs);
}

TEST(TouchingKeys, FrictionBeyondTwoAndPatchesTooFineAreRefusedWithTheirPlace) {
  EXPECT_ONE_MISTAKE(mistakes_with("/contact/organ_friction", 2.5), "contact/organ_friction",
                     "found 2.5, expected a number from 0 to 2");
  EXPECT_ONE_MISTAKE(mistakes_with("/contact/organ_pitch", 0.01), "contact/organ_pitch",
                     "found 0.01, expected a number from 0.1 to 4");
  EXPECT_ONE_MISTAKE(mistakes_with("/contact/organs", "all"), "contact/organs", "found");
}

}  // namespace
}  // namespace viscera::test
