#include "kernels/smoke/gas_pressure.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <functional>

#include "kernels/base/random.h"

namespace viscera {
namespace {

using IsGas = std::function<bool(int, int, int)>;

// The equation of a box of gas cells of unit size whose upper side in z is open or not.
struct Problem {
  GasPressure pressure;
  std::vector<std::uint8_t> gas;

  Problem(const std::array<int, 3>& n, bool open, const IsGas& is_gas) : pressure(n) {
    const GasLayout& layout = pressure.layout();
    const auto count = static_cast<std::size_t>(layout.count);
    gas.assign(count, 0);
    layout.rows([&](std::ptrdiff_t c, int length, int j, int k) {
      for (int i = 0; i < length; ++i) gas[static_cast<std::size_t>(c + i)] = is_gas(i, j, k);
    });
    GasFaces faces;
    for (int axis = 0; axis < 3; ++axis) {
      faces[axis].assign(count, 0.0f);
      layout.rows([&](std::ptrdiff_t c, int length, int, int) {
        for (std::ptrdiff_t i = c; i < c + length; ++i) {
          const bool passes = gas[static_cast<std::size_t>(i)] &&
                              gas[static_cast<std::size_t>(i - layout.stride[axis])];
          if (passes) faces[axis][static_cast<std::size_t>(i)] = 1.0f;
        }
      });
    }
    if (open) {
      for (int j = 0; j < n[1]; ++j) {
        for (int i = 0; i < n[0]; ++i) {
          if (is_gas(i, j, n[2] - 1)) {
            faces[2][static_cast<std::size_t>(layout.index(i, j, n[2]))] = 1.0f;
          }
        }
      }
    }
    pressure.set_openings(faces);
  }

  std::vector<float> random_field(std::uint64_t seed) const {
    std::vector<float> field(gas.size(), 0.0f);
    const Random random(seed, 0);
    for (std::size_t i = 0; i < field.size(); ++i) {
      if (gas[i]) field[i] = static_cast<float>(random.uniform(i) - 0.5);
    }
    return field;
  }
  // A right side that has a solution, also where regions are closed.
  std::vector<float> random_right_side(std::uint64_t seed) const {
    std::vector<float> b(gas.size(), 0.0f);
    pressure.apply(random_field(seed), b);
    return b;
  }
};

double dot(const std::vector<float>& a, const std::vector<float>& b) {
  double sum = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    sum += static_cast<double>(a[i]) * static_cast<double>(b[i]);
  }
  return sum;
}

bool with_a_block(int i, int j, int k) {
  return !(i >= 2 && i < 4 && j >= 1 && j < 5 && k < 4);
}

// A cavity between two bumpy bodies, with a thin plate in it that leaves a gap.
IsGas cavity(int n) {
  return [n](int i, int j, int k) {
    const double x = (i + 0.5) / n, y = (j + 0.5) / n, z = (k + 0.5) / n;
    const bool floor = z < 0.3 + 0.15 * std::sin(9.0 * x) * std::cos(7.0 * y);
    const bool dome = (x - 0.5) * (x - 0.5) + (y - 0.5) * (y - 0.5) + (z - 0.3) * (z - 0.3) > 0.22;
    const bool plate = k == n / 2 && x > 0.45;
    return !floor && !dome && !plate;
  };
}

TEST(GasPressure, SolutionIsThatOfADenseSolve) {
  Problem problem({7, 6, 5}, true, with_a_block);
  const GasLayout& layout = problem.pressure.layout();
  std::vector<std::ptrdiff_t> cells;
  for (std::ptrdiff_t i = 0; i < layout.count; ++i) {
    if (problem.gas[static_cast<std::size_t>(i)]) cells.push_back(i);
  }
  const auto unknowns = static_cast<Eigen::Index>(cells.size());
  MatrixX dense(unknowns, unknowns);
  std::vector<float> unit(problem.gas.size(), 0.0f), column(unit);
  for (Eigen::Index c = 0; c < unknowns; ++c) {
    unit[static_cast<std::size_t>(cells[static_cast<std::size_t>(c)])] = 1.0f;
    problem.pressure.apply(unit, column);
    unit[static_cast<std::size_t>(cells[static_cast<std::size_t>(c)])] = 0.0f;
    for (Eigen::Index r = 0; r < unknowns; ++r) {
      dense(r, c) = column[static_cast<std::size_t>(cells[static_cast<std::size_t>(r)])];
    }
  }
  EXPECT_EQ(dense, dense.transpose());
  EXPECT_EQ(dense(0, 0), 3.0);  // a corner of the closed bottom
  const std::vector<float> b = problem.random_right_side(3);
  std::vector<float> x(b.size(), 0.0f);
  const auto outcome = problem.pressure.solve(b, x, 1e-5);
  EXPECT_TRUE(outcome.converged);
  VectorX right(unknowns);
  for (Eigen::Index r = 0; r < unknowns; ++r) {
    right[r] = b[static_cast<std::size_t>(cells[static_cast<std::size_t>(r)])];
  }
  const VectorX exact = dense.lu().solve(right);
  for (Eigen::Index r = 0; r < unknowns; ++r) {
    EXPECT_NEAR(x[static_cast<std::size_t>(cells[static_cast<std::size_t>(r)])], exact[r],
                1e-4 * exact.cwiseAbs().maxCoeff());
  }
}

TEST(GasPressure, OperatorAndPreconditionerAreSymmetricAndPositive) {
  for (const bool open : {false, true}) {
    Problem problem({13, 10, 9}, open, with_a_block);
    const std::vector<float> a = problem.random_right_side(1), b = problem.random_right_side(2);
    std::vector<float> product_a(a.size(), 0.0f), product_b(a.size(), 0.0f);
    problem.pressure.apply(a, product_a);
    problem.pressure.apply(b, product_b);
    EXPECT_NEAR(dot(product_a, b), dot(a, product_b),
                1e-5 * std::sqrt(dot(product_a, product_a) * dot(b, b)));
    EXPECT_GT(dot(product_a, a), 0.0);
    problem.pressure.precondition(a, product_a);
    problem.pressure.precondition(b, product_b);
    EXPECT_NEAR(dot(product_a, b), dot(a, product_b),
                1e-5 * std::sqrt(dot(product_a, product_a) * dot(b, b)));
    EXPECT_GT(dot(product_a, a), 0.0);
  }
}

TEST(GasPressure, IterationsHardlyGrowWithResolution) {
  for (const bool open : {false, true}) {
    for (const int n : {16, 32, 48, 64}) {
      for (const bool solids : {false, true}) {
        Problem problem({n, n, n}, open,
                        solids ? cavity(n) : IsGas([](int, int, int) { return true; }));
        const std::vector<float> b = problem.random_right_side(7);
        std::vector<float> x(b.size(), 0.0f);
        const auto outcome = problem.pressure.solve(b, x, 1e-4 * std::sqrt(dot(b, b)));
        EXPECT_TRUE(outcome.converged);
        EXPECT_LE(outcome.iterations, 14)
            << n << (open ? " open" : " closed") << (solids ? " cavity" : " box");
      }
    }
  }
}

TEST(GasPressure, RegionsThatAreClosedOffAreSolvedEachByItself) {
  // A wall across the box; b sums to zero on either side of it.
  Problem problem({12, 8, 8}, false, [](int i, int, int) { return i != 5; });
  const GasLayout& layout = problem.pressure.layout();
  std::vector<float> b(problem.gas.size(), 0.0f), x(b), product(b);
  b[static_cast<std::size_t>(layout.index(1, 2, 3))] = 1.0f;
  b[static_cast<std::size_t>(layout.index(4, 7, 7))] = -1.0f;
  b[static_cast<std::size_t>(layout.index(6, 0, 0))] = -2.0f;
  b[static_cast<std::size_t>(layout.index(11, 1, 6))] = 2.0f;
  const auto outcome = problem.pressure.solve(b, x, 1e-4);
  EXPECT_TRUE(outcome.converged);
  problem.pressure.apply(x, product);
  for (std::size_t i = 0; i < b.size(); ++i) EXPECT_NEAR(product[i], b[i], 2e-4);
}

TEST(GasPressure, AGoodGuessSavesIterationsAndABadOneIsDropped) {
  Problem problem({24, 24, 24}, true, cavity(24));
  const std::vector<float> b = problem.random_right_side(5);
  const double tolerance = 1e-4 * std::sqrt(dot(b, b));
  std::vector<float> x(b.size(), 0.0f);
  const int cold = problem.pressure.solve(b, x, tolerance).iterations;
  EXPECT_EQ(problem.pressure.solve(b, x, 2.0 * tolerance).iterations, 0);
  for (float& value : x) value *= 1e6f;
  const auto again = problem.pressure.solve(b, x, tolerance);
  EXPECT_TRUE(again.converged);
  EXPECT_EQ(again.iterations, cold);
}

TEST(GasPressure, NothingToSolveTakesNoIteration) {
  Problem problem({6, 6, 6}, false, [](int, int, int) { return false; });
  std::vector<float> x(problem.gas.size(), 0.0f);
  const auto outcome = problem.pressure.solve(x, x, 0.0);
  EXPECT_EQ(outcome.iterations, 0);
  EXPECT_TRUE(outcome.converged);
}

}  // namespace
}  // namespace viscera
