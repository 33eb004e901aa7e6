#include "haptics/z_width.h"

#include <gtest/gtest.h>

#include <cmath>

namespace viscera {
namespace {

ZWidthCase firm_and_damped() {
  ZWidthCase trial;
  trial.grip = 1.0;
  trial.damping = 2.0;
  return trial;
}

TEST(ZWidth, StiffnessIsTriedFromTenNewtonsAMetreUpByTenthsAndNoFartherThanAsked) {
  // 10, 11, 12.1, 13.3, 14.6, 16.1 N/m.
  EXPECT_NEAR(greatest_stable_stiffness(firm_and_damped(), 15.0), 10.0 * std::pow(1.1, 4), 1e-9);
  EXPECT_NEAR(greatest_stable_stiffness(firm_and_damped(), 10.0), 10.0, 1e-12);
  EXPECT_EQ(greatest_stable_stiffness(firm_and_damped(), 9.0), 0.0) << "none was tried";
}

TEST(ZWidth, AHandThatRestsAgainstAWallMovesNoMoreAndFeelsANewton) {
  const ZWidthTrial out = press_wall(firm_and_damped());
  EXPECT_TRUE(out.stable);
  EXPECT_LT(out.rattle, 1e-3);
  // But for the joints' friction and what a step of the encoders is behind 1000 N/m.
  EXPECT_NEAR(out.force, 1.0, 0.04 + 0.03);
}

}  // namespace
}  // namespace viscera
