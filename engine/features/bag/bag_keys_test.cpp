#include "engine/features/bag/bag_keys.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "tests/engine/scene/scene_fixture.h"

namespace viscera::test {
namespace {

TEST(BagKeys, ArriveInMetresAndOnlyOfBags) {
  const auto scene = SceneFolder().load(whole_scene());
  ASSERT_TRUE(scene) << scene.error().text();
  const auto tool = std::ranges::find(scene->instruments, "bag", &InstrumentDescription::name);
  ASSERT_NE(tool, scene->instruments.end());
  EXPECT_EQ(tool->kind, InstrumentKind::kBag);
  ASSERT_TRUE(bag_of(*tool));
  EXPECT_DOUBLE_EQ(bag_of(*tool)->mouth, 65e-3);
  EXPECT_DOUBLE_EQ(bag_of(*tool)->depth, 120e-3);
  EXPECT_FALSE(bag_of(scene->instruments[0]));
}

TEST(BagKeys, OfOtherInstrumentsAreRefusedWithTheirPlace) {
  EXPECT_ONE_MISTAKE(mistakes_with("/instruments/0/mouth_mm", 60), "instruments/0/mouth_mm",
                     "found 60", "kind");
}

}  // namespace
}  // namespace viscera::test
