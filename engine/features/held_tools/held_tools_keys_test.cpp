#include "engine/features/held_tools/held_tools_keys.h"

#include <gtest/gtest.h>

#include "tests/engine/scene/scene_fixture.h"

namespace viscera::test {
namespace {

TEST(HeldToolsKeys, ArriveInSiUnitsAndSeekRecordingsFromTheScenesFolder) {
  const SceneFolder folder;
  const Result<SceneDescription> scene = folder.load(whole_scene());
  ASSERT_TRUE(scene) << scene.error().text();
  EXPECT_TRUE(holds_tools(*scene));
  const HapticDescription* recorded = haptic_of(scene->instruments.at(0));
  ASSERT_TRUE(recorded);
  EXPECT_EQ(recorded->device, HapticDescription::Device::kRecorded);
  EXPECT_EQ(recorded->recording, folder.path() / "hand.csv");
  EXPECT_EQ(recorded->coupling_stiffness, 900.0);
  EXPECT_EQ(recorded->hive.radius, 0.012);
  EXPECT_EQ(recorded->hive.nodes, 90);
  EXPECT_EQ(recorded->hive.periphery, HiveDescription::Periphery::kBoussinesq);
  EXPECT_TRUE(recorded->hive.paper);
  const HapticDescription* simulated = haptic_of(scene->instruments.at(1));
  ASSERT_TRUE(simulated);
  EXPECT_EQ(simulated->device, HapticDescription::Device::kSimulated);
  EXPECT_EQ(simulated->recording, "");
  EXPECT_EQ(simulated->grip, HapticDescription::Grip::kFirm);
  EXPECT_FALSE(simulated->hive.periphery);
  const HapticDescription* network = haptic_of(scene->instruments.at(2));
  ASSERT_TRUE(network);
  EXPECT_EQ(network->device, HapticDescription::Device::kNetwork);
  EXPECT_EQ(network->port, 18945);
}

TEST(HeldToolsKeys, LeftOutMeanThatNoToolIsHeld) {
  Json text = whole_scene();
  for (Json& instrument : text["instruments"]) instrument.erase("haptic");
  const Result<SceneDescription> scene = SceneFolder().load(text);
  ASSERT_TRUE(scene) << scene.error().text();
  EXPECT_FALSE(holds_tools(*scene));
  EXPECT_FALSE(haptic_of(scene->instruments[0]));
}

TEST(HeldToolsKeys, AToolNeedsADeviceThatExistsAndWhatThatDeviceNeeds) {
  EXPECT_ONE_MISTAKE(mistakes_with("/instruments/1/haptic/device", "omega"),
                     "instruments/1/haptic/device", "found the text \"omega\"", "simulated",
                     "recorded", "network");
  EXPECT_ONE_MISTAKE(mistakes_with("/instruments/2/haptic/port", 70000),
                     "instruments/2/haptic/port", "found 70000", "1 to 65535");
  Json scene = whole_scene();
  scene["instruments"][0]["haptic"].erase("recording");
  EXPECT_ONE_MISTAKE(SceneFolder().mistakes(scene), "instruments/0/haptic/recording", "expected");
  EXPECT_ONE_MISTAKE(mistakes_with("/instruments/0/haptic/recording", "../hand.csv"),
                     "instruments/0/haptic/recording", "found ../hand.csv",
                     "expected the name of a file in");
  EXPECT_ONE_MISTAKE(mistakes_with("/instruments/0/haptic/recording", "/etc/passwd"),
                     "instruments/0/haptic/recording", "found the absolute path");
  EXPECT_ONE_MISTAKE(mistakes_with("/instruments/0/haptic/hive/nodes", 3),
                     "instruments/0/haptic/hive/nodes", "found 3", "12 to 1000");
}

}  // namespace
}  // namespace viscera::test
