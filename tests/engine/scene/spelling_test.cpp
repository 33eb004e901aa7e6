#include "engine/scene/spelling.h"

#include <gtest/gtest.h>

namespace viscera {
namespace {

const std::vector<std::string> kOrgans = {"liver", "gallbladder", "stomach", "kidney"};

TEST(Spelling, NearestCandidateIsFound) {
  EXPECT_EQ(nearest_spelling("livr", kOrgans), "liver");
  EXPECT_EQ(nearest_spelling("Kidney", kOrgans), "kidney");
  EXPECT_EQ(nearest_spelling("galblader", kOrgans), "gallbladder");
  EXPECT_EQ(nearest_spelling("stomahc", kOrgans), "stomach");
}

TEST(Spelling, NothingIsSuggestedForAStranger) {
  EXPECT_EQ(nearest_spelling("heart", kOrgans), "");
  EXPECT_EQ(nearest_spelling("", kOrgans), "");
  EXPECT_EQ(nearest_spelling(std::string(10000, 'x'), kOrgans), "");
  EXPECT_EQ(did_you_mean("xyzzy", kOrgans), "");
}

TEST(Spelling, UnitsAreSplitFromKeys) {
  EXPECT_EQ(split_unit("radius_mm").unit, "mm");
  EXPECT_EQ(split_unit("radius_mm").stem, "radius");
  EXPECT_EQ(split_unit("particle_mass_ug").unit, "ug");
  EXPECT_EQ(split_unit("round_mask").unit, "");
  EXPECT_EQ(split_unit("_mm").unit, "");
}

}  // namespace
}  // namespace viscera
