// A planted mutant is the original until its number is asked for. This program is started with no
// mutant switched on; what a mutant does is asked of the parts that take the switch as a flag.
#include "tools/mutation/mutant_switch.h"

#include <gtest/gtest.h>

#include "kernels/base/types.h"

namespace viscera_mutant {
namespace {

using viscera::Vec3;

TEST(MutantSwitch, WithoutANumberEverythingIsAsWritten) {
  EXPECT_EQ(5.0 - sign(0) * 2.0, 3.0);
  EXPECT_EQ(3 * factor(0) * 2, 6);
  EXPECT_EQ(7.0 * factor(0) / 2.0, 3.5);
  EXPECT_EQ(number(0, 0.5), 0.5);
  EXPECT_EQ(greatest(0)(1.0, 2.0), 2.0);
  EXPECT_EQ(least(0)({3, 1, 2}), 1);
  EXPECT_TRUE(1 + 1 < compare<Relation::kLess>(0) > 1 * 3);
  EXPECT_FALSE(2 < compare<Relation::kLess>(0) > 2);
  EXPECT_TRUE(2 < compare<Relation::kLessEqual>(0) > 2);
  EXPECT_TRUE(2.0 < compare<Relation::kUnequal>(0) > 1.0);
  const Vec3 a(1, 2, 3), b(4, 5, 6);
  EXPECT_EQ(Vec3(a - sign(0) * b), a - b);
  EXPECT_EQ(Vec3(a * factor(0) * 2.0), 2.0 * a);
}

TEST(MutantSwitch, TurnedOnItTurnsTheSignAndDoublesTheProduct) {
  EXPECT_EQ(5.0 - Sign{true} * 2.0, 7.0);
  EXPECT_EQ(5u + Sign{true} * 2u, 3u);
  EXPECT_EQ(3.0 * Factor{true} * 2.0, 12.0);
  const Vec3 a(1, 2, 3);
  EXPECT_EQ(Vec3(Sign{true} * a), -a);
  EXPECT_EQ(Vec3(a * Factor{true}), 2.0 * a);
  EXPECT_EQ((Extreme{false}(1.0, 2.0)), 1.0);
}

TEST(MutantSwitch, TurnedOnItMovesTheBorderOfWholeNumbersAndReversesOthers) {
  EXPECT_TRUE((2 < Comparison<Relation::kLess>{true}) > 2);
  EXPECT_FALSE((3 < Comparison<Relation::kLess>{true}) > 2);
  EXPECT_FALSE((2 < Comparison<Relation::kLessEqual>{true}) > 2);
  EXPECT_FALSE((2.0 < Comparison<Relation::kLess>{true}) > 3.0);
  EXPECT_TRUE((4.0 < Comparison<Relation::kLess>{true}) > 3.0);
  EXPECT_TRUE((2 < Comparison<Relation::kEqual>{true}) > 3);
}

}  // namespace
}  // namespace viscera_mutant
