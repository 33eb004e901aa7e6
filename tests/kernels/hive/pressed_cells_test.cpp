#include "kernels/hive/pressed_cells.h"

#include <gtest/gtest.h>

#include <limits>

#include "kernels/base/random.h"
#include "kernels/contact/unilateral.h"

namespace viscera {
namespace {

MatrixX positive_matrix(int n) {
  const Random random(11, static_cast<std::uint64_t>(n));
  MatrixX root(n, n);
  for (int i = 0; i < n * n; ++i) root.data()[i] = random.normal(static_cast<std::uint64_t>(i));
  return root * root.transpose() + 0.3 * MatrixX::Identity(n, n);
}

TEST(PressedCells, AgreeWithTheSolverOfWholeContacts) {
  PressedCells cells(60);
  const Random random(5, 2);
  for (const int n : {1, 2, 7, 19, 37, 60}) {
    const MatrixX matrix = positive_matrix(n);
    cells.begin(n) = matrix;
    ASSERT_TRUE(cells.check());
    EXPECT_EQ(cells.lifted(), 0.0);
    for (std::uint64_t round = 0; round < 5; ++round) {
      VectorX depths(n);
      for (int i = 0; i < n; ++i)
        depths[i] = random.normal(1000 * round + static_cast<std::uint64_t>(i));
      const auto figures = cells.solve({depths.data(), static_cast<std::size_t>(n)});
      ASSERT_TRUE(figures.converged);
      UnilateralSolver solver;
      std::vector<char> bilateral(static_cast<std::size_t>(n), 0),
          active(static_cast<std::size_t>(n), 0);
      VectorX expected;
      ASSERT_TRUE(solver.solve(matrix, depths, bilateral, active, expected).converged);
      const Eigen::Map<const VectorX> found(cells.forces().data(), n);
      EXPECT_LT((found - expected).norm(), 1e-9 * (1.0 + expected.norm())) << n;
      EXPECT_NEAR(figures.energy, 0.5 * expected.dot(matrix * expected),
                  1e-9 * (1.0 + figures.energy));
    }
  }
}

TEST(PressedCells, FactorOnlyWhenAnotherSetTouches) {
  PressedCells cells(19);
  cells.begin(19) = positive_matrix(19) + 50.0 * MatrixX::Identity(19, 19);
  ASSERT_TRUE(cells.check());
  std::vector<double> depths(19, 1e-3);
  EXPECT_EQ(cells.solve(depths).factorisations, 0);  // check() left that of all cells
  for (double& depth : depths) depth *= 1.5;
  EXPECT_EQ(cells.solve(depths).factorisations, 0);
  depths[3] = -1.0;
  EXPECT_GT(cells.solve(depths).factorisations, 0);
  EXPECT_EQ(cells.solve(depths).factorisations, 0);
}

TEST(PressedCells, RaiseWhatIsNotQuitePositiveAndRefuseTheRest) {
  PressedCells cells(3);
  MatrixX matrix = MatrixX::Constant(3, 3, 1.0);  // three cells at one spot
  cells.begin(3) = matrix;
  ASSERT_TRUE(cells.check());
  EXPECT_GT(cells.lifted(), 0.0);
  EXPECT_LT(cells.lifted(), 1e-3);
  cells.begin(3) = -matrix;
  EXPECT_FALSE(cells.check());
  matrix(2, 1) = std::numeric_limits<double>::quiet_NaN();
  cells.begin(3) = matrix;
  EXPECT_FALSE(cells.check());
  cells.begin(0);
  EXPECT_TRUE(cells.check());
  EXPECT_TRUE(cells.solve({}).converged);
}

TEST(PressedCells, GiveNoForceForADepthThatIsNotANumber) {
  PressedCells cells(2);
  cells.begin(2) = MatrixX::Identity(2, 2);
  ASSERT_TRUE(cells.check());
  const std::vector<double> depths{1.0, std::numeric_limits<double>::infinity()};
  EXPECT_FALSE(cells.solve(depths).converged);
  EXPECT_EQ(cells.forces()[0], 0.0);
}

}  // namespace
}  // namespace viscera
