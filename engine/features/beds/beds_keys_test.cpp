#include "engine/features/beds/beds_keys.h"

#include <gtest/gtest.h>

#include "tests/engine/scene/scene_fixture.h"

namespace viscera::test {
namespace {

TEST(BedsKeys, ArriveInSiUnits) {
  const Result<SceneDescription> scene = SceneFolder().load(whole_scene());
  ASSERT_TRUE(scene) << scene.error().text();
  const std::span<const BedDescription> beds = beds_of(*scene);
  ASSERT_EQ(beds.size(), 2u);
  EXPECT_EQ(beds[0].between, (std::array<std::string, 2>{"liver", "ball"}));
  EXPECT_DOUBLE_EQ(beds[0].within, 3e-3);
  EXPECT_DOUBLE_EQ(beds[0].pitch, 0.5e-3);
  EXPECT_DOUBLE_EQ(beds[0].law.strength, 8e3);
  EXPECT_DOUBLE_EQ(beds[0].law.stiffness, 20e6);
  EXPECT_DOUBLE_EQ(beds[0].law.toughness, 12.0);
  EXPECT_DOUBLE_EQ(beds[0].parts_at, 363.15);
  EXPECT_EQ(beds[0].region.radius, 0.004);
  ASSERT_TRUE(beds[0].film);
  EXPECT_DOUBLE_EQ(beds[0].film->strength, 15.0);
  EXPECT_DOUBLE_EQ(beds[0].film->stiffness, 10e3);
  EXPECT_DOUBLE_EQ(beds[0].film->toughness, 0.1);
  EXPECT_FALSE(beds[1].film);
  EXPECT_DOUBLE_EQ(beds[1].law.strength, 6e3);
  EXPECT_DOUBLE_EQ(beds[1].parts_at, 373.15);
}

TEST(BedsKeys, HoldTwoKnownOrgansOfWhichOneDeforms) {
  EXPECT_ONE_MISTAKE(mistakes_with("/beds/0/between/1", "bal"), "beds/0/between/1",
                     "found the text \"bal\", expected the name of an organ",
                     "did you mean \"ball\"");
  EXPECT_ONE_MISTAKE(mistakes_with("/beds/0/between/1", "liver"), "beds/0/between/1",
                     "found \"liver\" again, expected another than between/0");
  EXPECT_ONE_MISTAKE(mistakes_with("/beds/0/between/0", "brick"), "beds/0/between",
                     "found [\"brick\",\"ball\"], expected at least one deformable organ");
  EXPECT_ONE_MISTAKE(mistakes_with("/beds/0/between/1", "ground"), "beds/0/between/1",
                     "found \"ground\", expected an organ");
  EXPECT_ONE_MISTAKE(mistakes_with("/beds/1/name", "bed"), "beds/1/name", "again");
}

TEST(BedsKeys, SayWhatABondTakesUpBeforeItSoftens) {
  // 8 kPa at 20 kPa/mm: .4 mm.
  EXPECT_ONE_MISTAKE(mistakes_with("/beds/0/toughness_J_per_m2", 1.5), "beds/0/toughness_J_per_m2",
                     "found 1.5, expected more than 1.6");
  EXPECT_ONE_MISTAKE(mistakes_with("/beds/0/strength_kPa", -1), "beds/0/strength_kPa",
                     "found -1, expected a number from 0.1");
}

TEST(BedsKeys, SayWhatAFilmTakesUpBeforeItGivesWay) {
  // 15 N/m at 10 N/m a millimetre: 1.5 mm.
  EXPECT_ONE_MISTAKE(mistakes_with("/beds/0/film/toughness_J_per_m", 0.01),
                     "beds/0/film/toughness_J_per_m", "found 0.01, expected more than 0.01125");
}

TEST(BedsKeys, NeedOrgansThatTouch) {
  EXPECT_ONE_MISTAKE(mistakes_with("/contact/organs", false), "beds",
                     "expected contact/organs to be true");
}

}  // namespace
}  // namespace viscera::test
