#include "engine/features/parting/parting_keys.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "tests/engine/scene/scene_fixture.h"

namespace viscera::test {
namespace {

TEST(PartingKeys, ArriveInMetresAndOnlyWhereTheyStand) {
  const auto scene = SceneFolder().load(whole_scene());
  ASSERT_TRUE(scene) << scene.error().text();
  const auto cuttable = [&](const char* name) {
    const auto organ = std::ranges::find(scene->organs, name, &OrganDescription::name);
    return organ == scene->organs.end() ? nullptr : cuttable_of(*organ);
  };
  ASSERT_TRUE(cuttable("brick"));
  EXPECT_DOUBLE_EQ(cuttable("brick")->voxel, 0.3e-3);
  EXPECT_TRUE(cuttable("brick")->tears);
  EXPECT_FALSE(cuttable("liver"));
  const BladeDescription* blade =
      blade_of(*std::ranges::find(scene->instruments, "knife", &InstrumentDescription::name));
  ASSERT_TRUE(blade);
  EXPECT_DOUBLE_EQ(blade->length, 8e-3);
  EXPECT_DOUBLE_EQ(blade->thickness, 0.5e-3);
  EXPECT_FALSE(blade_of(scene->instruments[0]));
  EXPECT_DOUBLE_EQ(bore_of(scene->instruments[0]), 15e-3);
  EXPECT_DOUBLE_EQ(
      bore_of(*std::ranges::find(scene->instruments, "pincher", &InstrumentDescription::name)),
      12e-3);
}

TEST(PartingKeys, OfBladesThatAreNoneAndVoxelsOfNoSizeAreRefusedWithTheirPlace) {
  EXPECT_ONE_MISTAKE(mistakes_with("/instruments/2/blade_mm", 8), "instruments/2/blade_mm",
                     "found 8", "kind");
  EXPECT_ONE_MISTAKE(mistakes_with("/instruments/0/bore_mm", 0), "instruments/0/bore_mm", "found 0",
                     "expected a number from 3 to 60");
  EXPECT_ONE_MISTAKE(mistakes_with("/instruments/2/bore_mm", 12), "instruments/2/bore_mm",
                     "found 12", "kind");
  EXPECT_ONE_MISTAKE(mistakes_with("/organs/2/cuttable/voxel_mm", 0), "organs/2/cuttable/voxel_mm",
                     "found 0", "expected a number from 0.1 to 1");
}

}  // namespace
}  // namespace viscera::test
