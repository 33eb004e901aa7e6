#include "kernels/contact/unilateral.h"

#include <gtest/gtest.h>

#include <cmath>

#include "kernels/base/random.h"

namespace viscera {
namespace {

struct Problem {
  MatrixX matrix;
  VectorX b;
  std::vector<char> bilateral;
};

/// A random symmetric positive definite problem; every `every`-th unknown is bilateral (0: none).
Problem random_problem(int n, std::uint64_t seed, int every) {
  const Random random(seed, 0);
  std::uint64_t draw = 0;
  MatrixX root(n, n);
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < n; ++j) root(i, j) = random.normal(draw++);
  }
  Problem problem{root * root.transpose() + 0.01 * MatrixX::Identity(n, n), VectorX(n),
                  std::vector<char>(static_cast<std::size_t>(n), 0)};
  for (int i = 0; i < n; ++i) problem.b[i] = random.normal(draw++);
  for (int i = 0; every > 0 && i < n; i += every)
    problem.bilateral[static_cast<std::size_t>(i)] = 1;
  return problem;
}

void expect_solved(const Problem& problem, const VectorX& x, double tolerance) {
  const VectorX w = problem.matrix * x - problem.b;
  for (Eigen::Index i = 0; i < x.size(); ++i) {
    if (problem.bilateral[static_cast<std::size_t>(i)]) {
      EXPECT_NEAR(w[i], 0.0, tolerance);
      continue;
    }
    EXPECT_GE(x[i], 0.0);
    EXPECT_GE(w[i], -tolerance);
    EXPECT_NEAR(x[i] * w[i], 0.0, tolerance);
  }
}

/// The one active set of all 2^n whose solution meets every condition.
VectorX by_enumeration(const Problem& problem) {
  const int n = static_cast<int>(problem.b.size());
  for (int set = 0; set < (1 << n); ++set) {
    std::vector<int> active;
    bool allowed = true;
    for (int i = 0; i < n; ++i) {
      if (set & (1 << i)) active.push_back(i);
      allowed &= (set & (1 << i)) || !problem.bilateral[static_cast<std::size_t>(i)];
    }
    if (!allowed) continue;
    VectorX x = VectorX::Zero(n);
    if (!active.empty()) {
      const MatrixX part = problem.matrix(active, active);
      const VectorX rhs = problem.b(active);
      const VectorX amounts = part.ldlt().solve(rhs);
      x(active) = amounts;
    }
    const VectorX w = problem.matrix * x - problem.b;
    for (int i = 0; i < n; ++i) {
      if (problem.bilateral[static_cast<std::size_t>(i)]) continue;
      allowed &= x[i] >= -1e-9 && w[i] >= -1e-9;
    }
    if (allowed) return x;
  }
  return VectorX::Constant(n, std::nan(""));
}

TEST(Unilateral, AgreesWithEnumerationOfAllActiveSets) {
  for (std::uint64_t seed = 0; seed < 60; ++seed) {
    const Problem problem = random_problem(8, seed, seed % 3 == 0 ? 3 : 0);
    UnilateralSolver solver;
    std::vector<char> active(8, 0);
    VectorX x;
    const UnilateralFigures figures =
        solver.solve(problem.matrix, problem.b, problem.bilateral, active, x);
    ASSERT_TRUE(figures.converged) << seed;
    EXPECT_LT((x - by_enumeration(problem)).norm(), 1e-6 * (1.0 + x.norm())) << seed;
  }
}

TEST(Unilateral, LargeProblemsMeetEveryCondition) {
  for (std::uint64_t seed = 100; seed < 106; ++seed) {
    const Problem problem = random_problem(150, seed, 10);
    UnilateralSolver solver;
    std::vector<char> active(150, 0);
    VectorX x;
    const UnilateralFigures figures =
        solver.solve(problem.matrix, problem.b, problem.bilateral, active, x);
    ASSERT_TRUE(figures.converged);
    EXPECT_GT(figures.smallest_eigenvalue, 0.0);
    expect_solved(problem, x, 1e-7);
  }
}

TEST(Unilateral, ResultDoesNotDependOnTheGuess) {
  const Problem problem = random_problem(40, 5, 0);
  UnilateralSolver solver;
  std::vector<char> none(40, 0), all(40, 1);
  VectorX from_none, from_all, again;
  ASSERT_TRUE(
      solver.solve(problem.matrix, problem.b, problem.bilateral, none, from_none).converged);
  ASSERT_TRUE(solver.solve(problem.matrix, problem.b, problem.bilateral, all, from_all).converged);
  EXPECT_LT((from_none - from_all).norm(), 1e-9 * (1.0 + from_none.norm()));
  const auto warm = solver.solve(problem.matrix, problem.b, problem.bilateral, none, again);
  EXPECT_EQ(warm.pivots, 0);
  EXPECT_EQ(again, from_none);
}

/// So a solver needs no state.
TEST(Unilateral, AFreshSolverAnswersAsOneThatHasSolvedBefore) {
  Problem problem = random_problem(40, 5, 7);
  UnilateralSolver used;
  std::vector<char> active(40, 0);
  VectorX x;
  used.solve(problem.matrix, problem.b, problem.bilateral, active, x);
  for (int step = 0; step < 6; ++step) {
    problem.b[step] += step % 2 ? 0.0 : 0.3;  // every second time the active set stays
    std::vector<char> guess = active;
    VectorX other;
    UnilateralSolver fresh;
    const auto one =
        used.solve(problem.matrix, problem.b, problem.bilateral, active, x, true, true);
    const auto two =
        fresh.solve(problem.matrix, problem.b, problem.bilateral, guess, other, true, true);
    EXPECT_EQ(x, other);
    EXPECT_EQ(active, guess);
    EXPECT_EQ(one.pivots, two.pivots);
    EXPECT_EQ(one.smallest_eigenvalue, two.smallest_eigenvalue);
  }
}

TEST(Unilateral, SmallestEigenvalueIsEstimatedWithinAFactor) {
  Problem problem = random_problem(12, 3, 1);  // all bilateral: the whole matrix is active
  problem.matrix.setIdentity();
  problem.matrix(4, 4) = 1e-3;
  UnilateralSolver solver;
  std::vector<char> active(12, 0);
  VectorX x;
  const auto figures = solver.solve(problem.matrix, problem.b, problem.bilateral, active, x);
  EXPECT_NEAR(figures.smallest_eigenvalue, 1e-3, 1e-4);
}

TEST(Unilateral, IndefiniteMatrixIsReportedWithoutForces) {
  Problem problem = random_problem(6, 1, 1);
  problem.matrix(2, 2) = -1.0;
  UnilateralSolver solver;
  std::vector<char> active(6, 0);
  VectorX x;
  const auto figures = solver.solve(problem.matrix, problem.b, problem.bilateral, active, x);
  EXPECT_FALSE(figures.converged);
  EXPECT_TRUE(x.isZero());
}

TEST(Unilateral, NonFiniteInputIsReportedWithoutForces) {
  Problem problem = random_problem(6, 1, 1);
  problem.b[3] = std::nan("");
  UnilateralSolver solver;
  std::vector<char> active(6, 0);
  VectorX x;
  EXPECT_FALSE(solver.solve(problem.matrix, problem.b, problem.bilateral, active, x).converged);
  EXPECT_TRUE(x.isZero());
}

TEST(Unilateral, UnsymmetricProblemsMeetEveryCondition) {
  const Random random(5, 9);
  std::uint64_t draw = 0;
  for (int trial = 0; trial < 20; ++trial) {
    Problem problem = random_problem(20, 100 + static_cast<std::uint64_t>(trial), 5);
    // A positive matrix plus a twist keeps its principal minors positive.
    for (int i = 0; i < 20; ++i) {
      for (int j = 0; j < i; ++j) {
        const double twist = 3.0 * random.normal(draw++);
        problem.matrix(i, j) += twist;
        problem.matrix(j, i) -= twist;
      }
    }
    std::vector<char> active(20, 0);
    VectorX x;
    const UnilateralFigures figures =
        UnilateralSolver().solve(problem.matrix, problem.b, problem.bilateral, active, x, false);
    ASSERT_TRUE(figures.converged);
    EXPECT_GT(figures.smallest_eigenvalue, 0.0);
    expect_solved(problem, x, 1e-9 * problem.matrix.norm() * std::max(1.0, x.norm()));
  }
}

TEST(Unilateral, ComplianceThatGivesOutEnergyShowsInItsSmallestEigenvalue) {
  // Principal minors 1, 1 and 1 + 9: solvable, though its symmetric half isn't positive.
  MatrixX matrix(2, 2);
  matrix << 1.0, 4.5, -2.0, 1.0;
  const std::vector<char> bilateral{1, 1};
  std::vector<char> active(2, 0);
  VectorX x;
  const UnilateralFigures figures =
      UnilateralSolver().solve(matrix, VectorX::Ones(2), bilateral, active, x, false);
  EXPECT_TRUE(figures.converged);
  EXPECT_LT((matrix * x - VectorX::Ones(2)).norm(), 1e-12);
  EXPECT_NEAR(figures.smallest_eigenvalue, (1.0 - 1.25) / (1.0 + 1.25), 1e-12);
}

TEST(Unilateral, NothingActiveHasNoEigenvalueToMeasure) {
  // One solver, as a contact keeps it: a large active set first, then a smaller problem in which
  // nothing pushes.
  UnilateralSolver solver;
  VectorX x;
  for (const int size : {9, 3, 9, 2}) {
    const MatrixX matrix = MatrixX::Identity(size, size);
    const bool pushes = size == 9;
    const VectorX wanted = VectorX::Constant(size, pushes ? 1.0 : -1.0);
    const std::vector<char> bilateral(static_cast<std::size_t>(size), 0);
    std::vector<char> active(static_cast<std::size_t>(size), 1);
    const UnilateralFigures figures = solver.solve(matrix, wanted, bilateral, active, x, true);
    EXPECT_TRUE(figures.converged);
    EXPECT_NEAR(figures.smallest_eigenvalue, 1.0, 1e-12);
    EXPECT_NEAR(x.sum(), pushes ? size : 0.0, 1e-12);
  }
}

TEST(Unilateral, SingularUnsymmetricMatrixIsReportedWithoutForces) {
  MatrixX matrix(2, 2);
  matrix << 1.0, 2.0, 2.0, 4.0;
  const std::vector<char> bilateral{1, 1};
  std::vector<char> active(2, 0);
  VectorX x;
  EXPECT_FALSE(
      UnilateralSolver().solve(matrix, VectorX::Ones(2), bilateral, active, x, false).converged);
  EXPECT_EQ(x, VectorX::Zero(2));
}

}  // namespace
}  // namespace viscera
