#include "kernels/heat/super_steps.h"

#include <gtest/gtest.h>

namespace viscera {
namespace {

TEST(SuperSteps, StagesCoverTheSquareOfTheirNumber) {
  EXPECT_EQ(super_stages(0.5), 2);
  EXPECT_EQ(super_stages(2.5), 3);
  EXPECT_EQ(super_stages(2.6), 4);
  for (const double ratio : {1.0, 10.0, 100.0, 1000.0}) {
    const int s = super_stages(ratio);
    EXPECT_GE((s * s + s - 2) / 4.0, ratio);
    EXPECT_LT((s * s - s - 2) / 4.0, ratio);
  }
}

// y' = -a y: what a step multiplies y by.
double factor(double a, int stages) {
  double before = 1.0, now = 1.0;
  for (int j = 1; j <= stages; ++j) {
    const SuperStage s = super_stage(j, stages);
    const double next =
        s.newest * now + s.older * before + s.first - a * s.slope * now - a * s.first_slope;
    before = now;
    now = next;
  }
  return now;
}

TEST(SuperSteps, FollowDecayToThirdOrderInTheStep) {
  for (const int stages : {3, 5, 9}) {
    const double wide = std::abs(factor(0.1, stages) - std::exp(-0.1));
    const double narrow = std::abs(factor(0.05, stages) - std::exp(-0.05));
    EXPECT_NEAR(wide / narrow, 8.0, 1.0) << stages;
  }
}

TEST(SuperSteps, NothingGrowsUpToTheBound) {
  for (const int stages : {3, 4, 7, 20}) {
    // The bound of explicit steps is a = 2.
    const double most = 2.0 * (stages * stages + stages - 2) / 4.0;
    for (int i = 0; i <= 1000; ++i)
      EXPECT_LE(std::abs(factor(most * i / 1000.0, stages)), 1.0 + 1e-12);
  }
}

}  // namespace
}  // namespace viscera
