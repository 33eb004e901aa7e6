// A crack in the middle of a body, under pressure.
#include "engine/verification/penny_crack.h"

#include <gtest/gtest.h>

namespace viscera {
namespace {

TEST(PennyCrack, OpensAsItDoesInABodyWithoutEnd) {
  const PennyCrack crack;
  const auto opened = open_crack(crack);
  ASSERT_TRUE(opened) << opened.error().text();
  EXPECT_GT(opened->twins, 20u);
  const double exact = crack.exact_opening(0.0);
  RecordProperty("centre_error", std::to_string(opened->openings[0].opening / exact - 1.0));
  EXPECT_NEAR(opened->openings[0].opening, exact, 0.08 * exact);
}

}  // namespace
}  // namespace viscera
