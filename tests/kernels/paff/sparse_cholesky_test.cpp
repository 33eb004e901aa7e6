#include "kernels/paff/sparse_cholesky.h"

#include <gtest/gtest.h>

#include "kernels/base/random.h"

namespace viscera {
namespace {

/// A chain of n springs with blocks of this width, positive definite for `diagonal` > 2.
SymmetricBlockMatrix chain(int n, int width, double diagonal) {
  SymmetricBlockMatrix matrix;
  matrix.width = width;
  for (int row = 0; row < n; ++row) {
    for (int column = row; column < std::min(n, row + 2); ++column) {
      matrix.pattern.columns.push_back(column);
      for (int i = 0; i < width; ++i) {
        for (int j = 0; j < width; ++j) {
          matrix.blocks.push_back(i != j ? 0.0 : (row == column ? diagonal : -1.0));
        }
      }
    }
    matrix.pattern.row_begin.push_back(matrix.pattern.columns.size());
  }
  return matrix;
}

TEST(SparseCholesky, SolvesManyRightHandSides) {
  const SymmetricBlockMatrix matrix = chain(50, 3, 2.5);
  Result<SparseCholesky> factor = SparseCholesky::factor(matrix, 0.0, "chain");
  ASSERT_TRUE(factor) << factor.error().text();
  EXPECT_EQ(factor->order(), 150u);
  EXPECT_GT(factor->factor_bytes(), 150 * sizeof(double));
  const Random random(1, 1);
  std::vector<double> exact(150 * 4), right(150 * 4);
  for (std::size_t i = 0; i < exact.size(); ++i) exact[i] = random.uniform(i) - 0.5;
  for (std::size_t c = 0; c < 4; ++c) {
    matrix.multiply(std::span(exact).subspan(150 * c, 150), std::span(right).subspan(150 * c, 150));
  }
  ASSERT_TRUE(factor->solve(right, 4));
  for (std::size_t i = 0; i < exact.size(); ++i) EXPECT_NEAR(right[i], exact[i], 1e-13);
}

TEST(SparseCholesky, RefusesAnIndefiniteMatrix) {
  const Result<SparseCholesky> factor = SparseCholesky::factor(chain(50, 3, 1.0), 0.0, "chain");
  ASSERT_FALSE(factor);
  EXPECT_NE(factor.error().text().find("not positive definite"), std::string::npos);
}

TEST(SparseCholesky, SolvesWhereEveryNodeIsCoupledWithEveryOther) {
  // 2 on the diagonal and 1 elsewhere, per component: an ordering by nested dissection has nothing
  // to cut here, and PORD ended the process.
  SymmetricBlockMatrix matrix;
  matrix.width = 3;
  constexpr int kNodes = 40;
  for (int row = 0; row < kNodes; ++row) {
    for (int column = row; column < kNodes; ++column) {
      matrix.pattern.columns.push_back(column);
      for (int i = 0; i < 9; ++i) {
        matrix.blocks.push_back(i % 4 != 0 ? 0.0 : (row == column ? 2.0 : 1.0));
      }
    }
    matrix.pattern.row_begin.push_back(matrix.pattern.columns.size());
  }
  Result<SparseCholesky> factor = SparseCholesky::factor(matrix, 0.0, "full");
  ASSERT_TRUE(factor) << factor.error().text();
  std::vector<double> right(3 * kNodes, 1.0);
  ASSERT_TRUE(factor->solve(right, 1));
  for (const double x : right) EXPECT_NEAR(x, 1.0 / (kNodes + 1), 1e-14);
}

TEST(SparseCholesky, ShiftIsAddedToTheDiagonal) {
  EXPECT_TRUE(SparseCholesky::factor(chain(50, 3, 1.0), 1.5, "chain"));
}

TEST(SparseCholesky, RefusesRightHandSidesOfTheWrongSize) {
  Result<SparseCholesky> factor = SparseCholesky::factor(chain(10, 1, 3.0), 0.0, "chain");
  ASSERT_TRUE(factor);
  std::vector<double> right(15);
  EXPECT_FALSE(factor->solve(right, 1));
}

TEST(SparseCholesky, RefusesAnEmptyMatrix) {
  EXPECT_FALSE(SparseCholesky::factor(SymmetricBlockMatrix(), 0.0, "nothing"));
}

}  // namespace
}  // namespace viscera
