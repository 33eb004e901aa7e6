#include "kernels/contact/dense_cholesky.h"

#include <gtest/gtest.h>

#include <limits>

#include "kernels/base/random.h"

namespace viscera {
namespace {

MatrixX positive_matrix(int n, std::uint64_t seed) {
  const Random random(seed, 4);
  MatrixX root(n, n);
  for (int i = 0; i < n * n; ++i) root.data()[i] = random.normal(static_cast<std::uint64_t>(i));
  return root * root.transpose() + MatrixX::Identity(n, n);
}

TEST(DenseCholesky, SolvesMatricesOfEverySize) {
  DenseCholesky factor;  // one object: its memory grows and shrinks
  for (const int n : {1, 2, 3, 4, 5, 7, 8, 19, 57, 58, 111, 128, 129, 150, 6}) {
    const MatrixX matrix = positive_matrix(n, static_cast<std::uint64_t>(n));
    const VectorX expected = VectorX::LinSpaced(n, -1.0, 2.0);
    VectorX x = matrix * expected;
    ASSERT_TRUE(factor.compute(matrix)) << n;
    factor.solve_in_place(x);
    EXPECT_LT((x - expected).norm(), 1e-10 * matrix.norm() * expected.norm()) << n;
  }
}

TEST(DenseCholesky, ReadsTheLowerTriangleAlone) {
  MatrixX matrix = positive_matrix(9, 3);
  const MatrixX whole = matrix;
  matrix.triangularView<Eigen::StrictlyUpper>().setConstant(7.0);
  VectorX x = whole * VectorX::Ones(9);
  DenseCholesky factor;
  ASSERT_TRUE(factor.compute(matrix));
  factor.solve_in_place(x);
  EXPECT_LT((x - VectorX::Ones(9)).norm(), 1e-11);
}

TEST(DenseCholesky, RefusesWhatIsNotPositiveOrNotFinite) {
  DenseCholesky factor;
  for (const int n : {3, 20, 140}) {
    MatrixX matrix = positive_matrix(n, 5);
    matrix(n - 1, n - 1) = -1.0;
    EXPECT_FALSE(factor.compute(matrix)) << n;
    matrix(n - 1, n - 1) = std::numeric_limits<double>::quiet_NaN();
    EXPECT_FALSE(factor.compute(matrix)) << n;
  }
}

TEST(DenseCholesky, NothingIsSolvedAtOnce) {
  DenseCholesky factor;
  VectorX none(0);
  EXPECT_TRUE(factor.compute(MatrixX(0, 0)));
  factor.solve_in_place(none);
}

}  // namespace
}  // namespace viscera
