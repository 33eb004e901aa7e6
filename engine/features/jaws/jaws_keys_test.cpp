#include "engine/features/jaws/jaws_keys.h"

#include <gtest/gtest.h>

#include "tests/engine/scene/scene_fixture.h"

namespace viscera::test {
namespace {

/// whole_scene() with these keys for its first instrument, a grasper, in place of its limit.
std::vector<std::string> mistakes_with_jaws(const Json& keys) {
  Json holder = whole_scene()["instruments"][0];
  holder.erase("grip_limit_N");
  holder.update(keys);
  return mistakes_with("/instruments/0", holder);
}

TEST(JawsKeys, ArriveAndStandInPlaceOfALimit) {
  Json scene = whole_scene();
  Json& holder = scene["instruments"][0];
  holder.erase("grip_limit_N");
  holder["grip_force_N"] = 3.0;
  const auto plain = SceneFolder().load(scene);
  ASSERT_TRUE(plain) << plain.error().text();
  const JawsDescription* jaws = jaws_of(plain->instruments[0]);
  ASSERT_TRUE(jaws);
  EXPECT_EQ(jaws->force, 3.0);
  EXPECT_NEAR(2.0 * jaws->friction * jaws->force, 5.0, 1e-12);
  EXPECT_TRUE(jaws->turns.empty());
  EXPECT_FALSE(jaws_of(plain->instruments[1]));
}

TEST(JawsKeys, WithoutGripForceOrBesideALimitAreRefusedWithTheirPlace) {
  EXPECT_ONE_MISTAKE(mistakes_with("/instruments/0/jaw_friction", 0.8),
                     "instruments/0/jaw_friction", "found 0.8", "only beside grip_force_N");
  EXPECT_ONE_MISTAKE(mistakes_with_jaws({{"grip_force_N", 0}}), "instruments/0/grip_force_N",
                     "found 0", "expected a number from 0.01 to 100");
  EXPECT_ONE_MISTAKE(mistakes_with("/instruments/0/grip_force_N", 3.0),
                     "instruments/0/grip_limit_N", "beside grip_force_N", "drop grip_limit_N");
  EXPECT_ONE_MISTAKE(mistakes_with_jaws({{"grip_force_N", 3}, {"jaw_friction", 2.5}}),
                     "instruments/0/jaw_friction", "found 2.5", "from 0.01 to 2");
  EXPECT_ONE_MISTAKE(mistakes_with("/instruments/1/grip_force_N", 3.0),
                     "instruments/1/grip_force_N", "only where kind is \"grasper\"");
}

}  // namespace
}  // namespace viscera::test
