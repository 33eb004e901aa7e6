#include "engine/features/gravity/gravity_keys.h"

#include <gtest/gtest.h>

#include <numbers>

#include "tests/engine/scene/scene_fixture.h"

namespace viscera::test {
namespace {

TEST(GravityKeys, ArriveInSiUnits) {
  constexpr double kDegree = std::numbers::pi / 180.0;
  const Result<SceneDescription> scene = SceneFolder().load(whole_scene());
  ASSERT_TRUE(scene) << scene.error().text();
  const GravityDescription* gravity = gravity_of(*scene);
  ASSERT_TRUE(gravity);
  EXPECT_EQ(gravity->acceleration, 1.62);
  EXPECT_EQ(gravity->rest_direction, Vec3(1, 0, 0));
  ASSERT_EQ(gravity->table.size(), 2u);
  EXPECT_EQ(gravity->table[1].time, 3.0);
  EXPECT_DOUBLE_EQ(gravity->table[1].head_up, 20 * kDegree);
  EXPECT_DOUBLE_EQ(gravity->table[1].left_down, 15 * kDegree);
  EXPECT_FALSE(sags(scene->organs[0]));
  EXPECT_TRUE(hung_in_image(scene->organs[0]));
  EXPECT_FALSE(hung_in_image(scene->organs[1]));
  EXPECT_TRUE(sags(scene->organs[1]));
}

TEST(GravityKeys, LeftOutMeanThatOrgansWeighNothing) {
  const Result<SceneDescription> scene = SceneFolder().load(least_scene());
  ASSERT_TRUE(scene) << scene.error().text();
  EXPECT_FALSE(gravity_of(*scene));
  EXPECT_TRUE(sags(scene->organs[0]));
}

TEST(GravityKeys, GravityThatCannotBeIsRefused) {
  EXPECT_ONE_MISTAKE(mistakes_with("/gravity/rest_direction", {0, 0, 0}), "gravity/rest_direction",
                     "found [0,0,0], expected a direction");
  EXPECT_ONE_MISTAKE(mistakes_with("/gravity/acceleration_m_per_s2", -9.81),
                     "gravity/acceleration_m_per_s2",
                     "found -9.81, expected a number from 0 to 100 [m_per_s2]");
  EXPECT_ONE_MISTAKE(mistakes_with("/gravity/acceleration", 9.81), "gravity/acceleration",
                     "found no unit, expected the unit m_per_s2");
  EXPECT_ONE_MISTAKE(mistakes_with("/gravity/table/1/head_up_deg", 120),
                     "gravity/table/1/head_up_deg",
                     "found 120, expected a number from -90 to 90 [deg]");
  EXPECT_ONE_MISTAKE(mistakes_with("/gravity/table/1/time_s", 0), "gravity/table/1/time_s",
                     "found 0 after 0, expected values that ascend");
  EXPECT_ONE_MISTAKE(mistakes_with("/organs/0/sags", "yes"), "organs/0/sags",
                     "found the text \"yes\", expected true or false");
}

}  // namespace
}  // namespace viscera::test
