#include "engine/features/cautery/cautery_keys.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "tests/engine/scene/scene_fixture.h"

namespace viscera::test {
namespace {

TEST(CauteryKeys, ArriveInSiUnits) {
  const Result<SceneDescription> scene = SceneFolder().load(whole_scene());
  ASSERT_TRUE(scene) << scene.error().text();
  const HeatDescription& heat = heat_of(*scene);
  EXPECT_EQ(heat.voxel, 0.00025);
  EXPECT_EQ(heat.lesion_of, "burner");
  ASSERT_TRUE(heat.published);
  EXPECT_EQ(heat.published->most_width, 0.004);
  EXPECT_EQ(heat.published->source, "recalled");
  EXPECT_EQ(mode_of(scene->instruments.at(1)), CurrentMode::kCoagulate);
  EXPECT_TRUE(is_spared(scene->organs[0]));
  EXPECT_FALSE(is_spared(scene->organs[1]));
  const auto pincher =
      std::ranges::find(scene->instruments, "pincher", &InstrumentDescription::name);
  ASSERT_NE(pincher, scene->instruments.end());
  ASSERT_TRUE(bipolar_of(*pincher));
  EXPECT_EQ(bipolar_of(*pincher)->holds, 40e3);
  EXPECT_DOUBLE_EQ(bipolar_of(*pincher)->blade, 9e-3);
  EXPECT_FALSE(pincher->path.at(0).blade);
  EXPECT_TRUE(pincher->path.at(1).blade);
  EXPECT_FALSE(bipolar_of(scene->instruments.at(1)));
}

TEST(CauteryKeys, LeftOutAreAsInTheStructures) {
  Json text = least_scene();
  text["instruments"] = Json::parse(R"([{"name": "h", "kind": "hook", "trocar_mm": [0, 0, 200],
      "path": [{"time_s": 0, "tip_mm": [0, 0, 100]}]}])");
  const Result<SceneDescription> scene = SceneFolder().load(text);
  ASSERT_TRUE(scene) << scene.error().text();
  EXPECT_EQ(heat_of(*scene).voxel, HeatDescription().voxel);
  EXPECT_TRUE(heat_of(*scene).lesion_of.empty());
  EXPECT_EQ(mode_of(scene->instruments[0]), mode_of(InstrumentDescription()));
  EXPECT_FALSE(is_spared(scene->organs[0]));
}

TEST(CauteryKeys, OfAPublishedLesionWhatIsNotSaidIsNotKnown) {
  Json text = whole_scene();
  text["heat"]["published"].erase("least_width_mm");
  const Result<SceneDescription> scene = SceneFolder().load(text);
  ASSERT_TRUE(scene) << scene.error().text();
  ASSERT_TRUE(heat_of(*scene).published);
  EXPECT_FALSE(heat_of(*scene).published->least_width);
  EXPECT_EQ(heat_of(*scene).published->most_width, 0.004);
}

TEST(CauteryKeys, AModeThatIsNoneSaysWhichIsMeant) {
  EXPECT_ONE_MISTAKE(mistakes_with("/instruments/1/mode", "cutt"), "instruments/1/mode",
                     "did you mean \"cut\"?");
  EXPECT_ONE_MISTAKE(mistakes_with("/instruments/0/mode", "cut"), "instruments/0/mode",
                     "expected this key only where kind is \"hook\", \"spatula\" or \"scissors\"");
}

TEST(CauteryKeys, BipolarJawsAreAGraspersThatHoldByTheirForce) {
  EXPECT_ONE_MISTAKE(mistakes_with("/instruments/1/bipolar", Json::object()),
                     "instruments/1/bipolar", "grip_force_N");
}

TEST(CauteryKeys, AKnifeIsOfSealingJawsAndSoIsItsTrigger) {
  EXPECT_ONE_MISTAKE(mistakes_with("/instruments/3/bipolar/blade_mm", 90),
                     "instruments/3/bipolar/blade_mm", "expected a number from 1 to 40");
  Json without = whole_scene();
  without["instruments"][3]["bipolar"].erase("blade_mm");
  EXPECT_ONE_MISTAKE(SceneFolder().mistakes(without), "instruments/3/path/1/blade",
                     "found true, expected false");
}

TEST(CauteryKeys, ScissorsConductAndHaveAMode) {
  Json text = whole_scene();
  Json scissors = *std::ranges::find_if(text["instruments"],
                                        [](const Json& tool) { return tool["name"] == "knife"; });
  scissors["name"] = "shears";
  scissors["kind"] = "scissors";
  scissors["mode"] = "cut";
  scissors["path"][0]["power_W"] = 40;
  text["instruments"].push_back(scissors);
  const Result<SceneDescription> scene = SceneFolder().load(text);
  ASSERT_TRUE(scene) << scene.error().text();
  EXPECT_EQ(mode_of(scene->instruments.back()), CurrentMode::kCut);
  EXPECT_TRUE(carries_current(scene->instruments.back()));
  EXPECT_FALSE(carries_current(
      *std::ranges::find(scene->instruments, "knife", &InstrumentDescription::name)))
      << "a scalpel doesn't";
}

TEST(CauteryKeys, ALesionIsOfAnInstrument) {
  EXPECT_ONE_MISTAKE(mistakes_with("/heat/lesion_of", "burnr"), "heat/lesion_of",
                     "did you mean \"burner\"");
}

}  // namespace
}  // namespace viscera::test
