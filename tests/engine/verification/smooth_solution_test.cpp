#include "engine/verification/smooth_solution.h"

#include <gtest/gtest.h>

namespace viscera {
namespace {

class SmoothSolutionTest : public testing::TestWithParam<double> {
 protected:
  SmoothSolution solution_{IsotropicMaterial{2.0, GetParam()}};
  const Vec3 place_{0.11, -0.23, 0.37};
};

/// Central differences of step h miss by h^2 / 6 times third derivatives of order 20.
constexpr double kStep = 1e-4, kMiss = 1e-6;

TEST_P(SmoothSolutionTest, GradientIsThatOfTheDisplacement) {
  for (int b = 0; b < 3; ++b) {
    const Vec3 step = kStep * Vec3::Unit(b);
    const Vec3 slope =
        (solution_.displacement(place_ + step) - solution_.displacement(place_ - step)) /
        (2.0 * kStep);
    EXPECT_LT((slope - solution_.gradient(place_).col(b)).norm(), kMiss);
  }
}

TEST_P(SmoothSolutionTest, BodyForceBalancesTheStress) {
  Vec3 divergence = Vec3::Zero();
  for (int b = 0; b < 3; ++b) {
    const Vec3 step = kStep * Vec3::Unit(b);
    divergence +=
        (solution_.stress(place_ + step) - solution_.stress(place_ - step)).col(b) / (2.0 * kStep);
  }
  const double size = solution_.body_force(place_).norm();
  EXPECT_GT(size, 1.0);
  // The stress grows with lambda while its divergence doesn't: round-off of the difference.
  EXPECT_LT((divergence + solution_.body_force(place_)).norm(), 1e-5 * size);
}

TEST_P(SmoothSolutionTest, PressureStaysBoundedNearIncompressibility) {
  EXPECT_LT(std::abs(solution_.stress(place_).trace()), 30.0);
}

INSTANTIATE_TEST_SUITE_P(Poisson, SmoothSolutionTest, testing::Values(0.0, 0.3, 0.49, 0.4999));

TEST(SmoothSolutionError, IsTheRelativeDistanceOverTheNodes) {
  const SmoothSolution exact({1.0, 0.3});
  PointCloud cloud;
  for (int i = 0; i < 64; ++i) cloud.positions.emplace_back(i % 4, i / 4 % 4, i / 16);
  cloud.spacings.assign(64, 1.0);
  // A field that is one vector everywhere, whatever its fields are: they add up to 1.
  std::vector<double> unknowns;
  double error = 0.0, size = 0.0;
  const Vec3 same(0.2, -0.1, 0.4);
  for (const Vec3& x : cloud.positions) {
    unknowns.insert(unknowns.end(), same.begin(), same.end());
    error += (same - exact.displacement(x)).squaredNorm();
    size += exact.displacement(x).squaredNorm();
  }
  EXPECT_NEAR(smooth_solution_error(exact, *find_formulation("galerkin"), cloud, unknowns),
              std::sqrt(error / size), 1e-12);
}

}  // namespace
}  // namespace viscera
