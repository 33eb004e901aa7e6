#include "kernels/baselines/strong_forms/sparse_lu.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "kernels/base/random.h"

namespace viscera {
namespace {

/// A ring of nodes, each tied to the next and the one after, with unsymmetric blocks.
BlockRows ring(int nodes, double diagonal) {
  const Random random(3, 0);
  std::uint64_t draw = 0;
  BlockRows matrix;
  for (int i = 0; i < nodes; ++i) {
    for (const int step : {2, 0, 1}) {
      matrix.columns.push_back((i + step) % nodes);
      Mat3 block = step == 0 ? Mat3(diagonal * Mat3::Identity()) : Mat3(Mat3::Zero());
      for (int k = 0; k < 9; ++k) block(k / 3, k % 3) += random.uniform(draw++) - 0.5;
      matrix.blocks.push_back(block);
    }
    matrix.row_begin.push_back(matrix.columns.size());
  }
  return matrix;
}

TEST(SparseLu, SolvesManyRightHandSides) {
  const BlockRows matrix = ring(40, 4.0);
  auto factor = SparseLu::factor(matrix, "ring");
  ASSERT_TRUE(factor) << factor.error().text();
  EXPECT_GT(factor->factor_bytes(), 0u);
  std::vector<double> wanted(120 * 2), right(120 * 2);
  for (std::size_t i = 0; i < wanted.size(); ++i) wanted[i] = std::sin(static_cast<double>(i));
  for (std::size_t c = 0; c < 2; ++c) {
    matrix.multiply(std::span<const double>(wanted).subspan(120 * c, 120),
                    std::span<double>(right).subspan(120 * c, 120));
  }
  ASSERT_TRUE(factor->solve(right, 2));
  for (std::size_t i = 0; i < wanted.size(); ++i) EXPECT_NEAR(right[i], wanted[i], 1e-12);
}

TEST(SparseLu, SolvesSparseVectors) {
  const BlockRows matrix = ring(20, 4.0);
  auto factor = SparseLu::factor(matrix, "ring");
  ASSERT_TRUE(factor);
  std::vector<double> columns(60 * 2), product(60);
  const std::vector<int> begin{0, 2, 3}, rows{7, 40, 31};
  ASSERT_TRUE(factor->solve_sparse(begin, rows, std::vector<double>{2.0, -1.0, 0.0}, columns));
  matrix.multiply(std::span<const double>(columns).first(60), product);
  for (std::size_t i = 0; i < 60; ++i) {
    EXPECT_NEAR(product[i], i == 7 ? 2.0 : i == 40 ? -1.0 : 0.0, 1e-12);
    EXPECT_EQ(columns[60 + i], 0.0);
  }
}

TEST(SparseLu, ItsMatrixFindsAResidualFarBelowRoundOffOfItsTerms) {
  const BlockRows matrix = ring(40, 4.0);
  std::vector<double> x(120), b(120);
  for (std::size_t i = 0; i < x.size(); ++i) x[i] = 1e6 * std::sin(static_cast<double>(i));
  matrix.multiply(x, b);
  // The rounding that b itself has, as found by sums in extended precision.
  const std::vector<double> rounding = matrix.residual(b, x);
  for (const double r : rounding) EXPECT_LT(std::abs(r), 1e-8);
  EXPECT_TRUE(std::any_of(rounding.begin(), rounding.end(), [](double r) { return r != 0.0; }));
  // A change of b by less than that comes out whole.
  std::vector<double> changed = b;
  changed[7] = std::nextafter(b[7], 2e9);
  const std::vector<double> after = matrix.residual(changed, x);
  for (std::size_t i = 0; i < after.size(); ++i) {
    const double change = changed[i] - b[i];
    EXPECT_NEAR(after[i] - rounding[i], change, 1e-2 * change) << i;
  }
}

TEST(SparseLu, OneRefinementTakesTheErrorOfAPerturbedSolutionAway) {
  const BlockRows matrix = ring(40, 4.0);
  auto factor = SparseLu::factor(matrix, "ring");
  ASSERT_TRUE(factor);
  std::vector<double> wanted(120), b(120);
  for (std::size_t i = 0; i < wanted.size(); ++i) wanted[i] = std::sin(static_cast<double>(i));
  matrix.multiply(wanted, b);
  std::vector<double> x = wanted;
  for (std::size_t i = 0; i < x.size(); i += 3) x[i] += 1e-6;
  std::vector<double> change = matrix.residual(b, x);
  ASSERT_TRUE(factor->solve(change, 1));
  for (std::size_t i = 0; i < x.size(); ++i) EXPECT_NEAR(x[i] + change[i], wanted[i], 1e-14);
}

TEST(SparseLu, RefusesASingularMatrixAndAnEmptyOne) {
  BlockRows matrix = ring(20, 4.0);
  for (std::size_t e = matrix.row_begin[5]; e < matrix.row_begin[6]; ++e) {
    matrix.blocks[e].row(1).setZero();
  }
  const auto refused = SparseLu::factor(matrix, "ring");
  ASSERT_FALSE(refused);
  EXPECT_NE(refused.error().text().find("ring: "), std::string::npos);
  EXPECT_FALSE(SparseLu::factor(BlockRows(), "nothing"));
}

}  // namespace
}  // namespace viscera
