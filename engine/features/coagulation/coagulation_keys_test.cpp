#include "engine/features/coagulation/coagulation_keys.h"

#include <gtest/gtest.h>

#include "tests/engine/scene/scene_fixture.h"

namespace viscera::test {
namespace {

TEST(CoagulationKeys, SayWhichOrgansStiffen) {
  const Result<SceneDescription> scene = SceneFolder().load(whole_scene());
  ASSERT_TRUE(scene) << scene.error().text();
  EXPECT_FALSE(stiffens(scene->organs[0]));
  EXPECT_TRUE(stiffens(scene->organs[1]));
}

TEST(CoagulationKeys, WhatIsNeitherTrueNorFalseIsRefused) {
  EXPECT_ONE_MISTAKE(mistakes_with("/organs/0/stiffens", 4), "organs/0/stiffens",
                     "found 4, expected true or false");
}

}  // namespace
}  // namespace viscera::test
