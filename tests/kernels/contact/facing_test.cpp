#include "kernels/contact/facing.h"

#include <gtest/gtest.h>

namespace viscera {
namespace {

TEST(Facing, IsWholeWithinSixtyDegreesAndNothingFromNinetyOn) {
  EXPECT_EQ(facing(1.0), 1.0);
  EXPECT_EQ(facing(0.5), 1.0);
  EXPECT_EQ(facing(0.0), 0.0);
  EXPECT_EQ(facing(-1.0), 0.0);
}

TEST(Facing, FallsSmoothlyBetween) {
  constexpr double kStep = 1e-4;
  double last = 0.0;
  for (double cosine = kStep; cosine < 0.5; cosine += kStep) {
    const double now = facing(cosine);
    EXPECT_GT(now, last);
    EXPECT_LT(now - last, 3.1 * kStep);
    last = now;
  }
  EXPECT_LT(facing(kStep), 1e-6);
  EXPECT_GT(facing(0.5 - kStep), 1.0 - 1e-6);
}

}  // namespace
}  // namespace viscera
