#include "kernels/paff/stiffness_factor.h"

#include <gtest/gtest.h>
#include <oneapi/tbb/global_control.h>

#include <numeric>

#include "tests/kernels/paff/elastic_bodies.h"

namespace viscera {
namespace {

bool on_floor(const Vec3& x) {
  return x.z() < -0.5 + 1e-9;
}

GalerkinSystem cube_system(const test::Body& body, double poisson_ratio) {
  return *GalerkinSystem::assemble(body.problem({10e3, poisson_ratio}, on_floor), 1.8,
                                   no_progress());
}

std::vector<int> every(int step, std::size_t count) {
  std::vector<int> nodes;
  for (int i = 0; i < static_cast<int>(count); i += step) nodes.push_back(i);
  return nodes;
}

/// Largest difference from the columns of another solver, over the largest entry.
double largest_difference(const SurfaceCompliance& compliance, SparseCholesky& exact) {
  std::vector<int> units;
  for (const int node : compliance.touchable) {
    for (int k = 0; k < 3; ++k) units.push_back(3 * node + k);
  }
  std::vector<double> columns(exact.order() * units.size());
  EXPECT_TRUE(exact.solve_units(units, columns));
  double difference = 0.0, largest = 0.0;
  for (std::size_t c = 0; c < units.size(); ++c) {
    for (std::size_t r = 0; r < compliance.rows(); ++r) {
      const auto unknown = static_cast<std::size_t>(3 * compliance.visible[r / 3]) + r % 3;
      const double wanted = columns[c * exact.order() + unknown];
      difference =
          std::max(difference, std::abs(compliance.columns[c * compliance.rows() + r] - wanted));
      largest = std::max(largest, std::abs(wanted));
    }
  }
  return difference / largest;
}

class CubeStiffness : public testing::Test {
 protected:
  test::Body body = test::jittered_cube(6, 0.3);
  GalerkinSystem system = cube_system(body, 0.3);
  const SymmetricBlockMatrix& stiffness = system.stiffness();

  StiffnessFactor factor(FactorPrecision precision) const {
    return *StiffnessFactor::factor(stiffness, body.cloud.positions, precision);
  }
};

TEST_F(CubeStiffness, SolvesInDoubleWhateverThePrecisionOfTheFactor) {
  const std::size_t n = 3 * body.cloud.size();
  std::vector<double> wanted(2 * n), product(n);
  for (std::size_t i = 0; i < wanted.size(); ++i) wanted[i] = std::sin(static_cast<double>(i));
  for (const auto precision : {FactorPrecision::single, FactorPrecision::full}) {
    std::vector<double> solution = wanted;
    ASSERT_TRUE(factor(precision).solve(stiffness, solution, 2));
    for (std::size_t c = 0; c < 2; ++c) {
      stiffness.multiply(std::span<const double>(solution).subspan(c * n, n), product);
      for (std::size_t i = 0; i < n; ++i) EXPECT_NEAR(product[i], wanted[c * n + i], 1e-11);
    }
  }
}

TEST_F(CubeStiffness, ComplianceOfFewOrManyColumnsIsThatOfMumps) {
  auto exact = system.factor();
  ASSERT_TRUE(exact);
  const std::vector<int> all = every(1, body.cloud.size());
  // Few columns are solved for, as many columns as rows come as products.
  for (const std::vector<int>& touchable :
       {every(40, body.cloud.size()), every(2, body.cloud.size()), all}) {
    for (const auto& [precision, bound] :
         {std::pair{FactorPrecision::single, 1e-5}, {FactorPrecision::full, 1e-7}}) {
      const StiffnessFactor factored = factor(precision);
      for (const std::vector<int>& visible : {all, touchable}) {
        const auto compliance = factored.compliance(visible, touchable, no_progress());
        ASSERT_TRUE(compliance) << compliance.error().text();
        EXPECT_LT(largest_difference(*compliance, *exact), bound);
      }
    }
  }
}

TEST_F(CubeStiffness, TouchableSquareIsItsOwnMirror) {
  const StiffnessFactor factored = factor(FactorPrecision::single);
  for (const int step : {40, 1}) {
    const std::vector<int> touchable = every(step, body.cloud.size());
    const auto compliance =
        factored.compliance(every(1, body.cloud.size()), touchable, no_progress());
    ASSERT_TRUE(compliance);
    EXPECT_TRUE(compliance->symmetric);
    const std::vector<std::size_t> row_of = compliance->touchable_rows();
    for (std::size_t i = 0; i < row_of.size(); ++i) {
      for (std::size_t j = 0; j < i; ++j) {
        ASSERT_EQ(compliance->columns[j * compliance->rows() + row_of[i]],
                  compliance->columns[i * compliance->rows() + row_of[j]]);
      }
    }
  }
}

TEST_F(CubeStiffness, ResultsDontDependOnTheNumberOfThreads) {
  for (const int step : {40, 1}) {
    const auto columns = [&](std::size_t threads) {
      const oneapi::tbb::global_control limit(oneapi::tbb::global_control::max_allowed_parallelism,
                                              threads);
      const std::vector<int> touchable = every(step, body.cloud.size());
      return factor(FactorPrecision::single)
          .compliance(every(1, body.cloud.size()), touchable, no_progress())
          ->columns;
    };
    EXPECT_EQ(columns(1), columns(4));
  }
}

TEST_F(CubeStiffness, PrecisionFollowsTheMeasuredError) {
  EXPECT_TRUE(factor(FactorPrecision::measured).is_single());
  EXPECT_FALSE(factor(FactorPrecision::full).is_single());
  EXPECT_EQ(factor(FactorPrecision::full).factor_bytes(),
            2 * factor(FactorPrecision::single).factor_bytes());
  const GalerkinSystem stiff = cube_system(body, 0.49999);
  const auto measured = StiffnessFactor::factor(stiff.stiffness(), body.cloud.positions);
  ASSERT_TRUE(measured) << measured.error().text();
  EXPECT_FALSE(measured->is_single());
}

TEST_F(CubeStiffness, RefusesMatricesThatAreNotPositiveDefinite) {
  SymmetricBlockMatrix negative = stiffness;
  for (double& entry : negative.blocks) entry = -entry;
  for (const auto precision :
       {FactorPrecision::single, FactorPrecision::full, FactorPrecision::measured}) {
    const auto refused = StiffnessFactor::factor(negative, body.cloud.positions, precision);
    ASSERT_FALSE(refused);
    EXPECT_NE(refused.error().text().find("not positive definite"), std::string::npos);
  }
}

TEST_F(CubeStiffness, RefusesWrongSizesAndLoadsThatAreNotFinite) {
  EXPECT_FALSE(
      StiffnessFactor::factor(stiffness, std::span<const Vec3>(body.cloud.positions).first(10)));
  const StiffnessFactor factored = factor(FactorPrecision::single);
  std::vector<double> load(7);
  EXPECT_FALSE(factored.solve(stiffness, load, 1));
  load.assign(3 * body.cloud.size(), 0.0);
  EXPECT_TRUE(factored.solve(stiffness, load, 1));
  EXPECT_EQ(load, std::vector<double>(load.size(), 0.0));
  load[5] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(factored.solve(stiffness, load, 1));
}

TEST_F(CubeStiffness, TinyAndHugeLoadsKeepTheirDigits) {
  const StiffnessFactor factored = factor(FactorPrecision::single);
  std::vector<double> one(3 * body.cloud.size(), 0.0);
  one[500] = 1.0;
  ASSERT_TRUE(factored.solve(stiffness, one, 1));
  for (const double size : {1e-60, 1e60}) {
    std::vector<double> load(one.size(), 0.0);
    load[500] = size;
    ASSERT_TRUE(factored.solve(stiffness, load, 1));
    for (std::size_t i = 0; i < one.size(); ++i) {
      EXPECT_NEAR(load[i] / size, one[i], 1e-11 * std::abs(one[500]));
    }
  }
}

TEST_F(CubeStiffness, DissectionOrdersEveryNodeOnceAndParentsLast) {
  const Dissection dissection = dissect(body.cloud.positions, stiffness.pattern);
  std::vector<int> sorted = dissection.order;
  std::sort(sorted.begin(), sorted.end());
  EXPECT_EQ(sorted, every(1, body.cloud.size()));
  int next = 0;
  for (std::size_t f = 0; f < dissection.fronts.size(); ++f) {
    const Dissection::Front& front = dissection.fronts[f];
    EXPECT_EQ(front.first, next);
    next = front.last;
    if (front.parent >= 0) {
      EXPECT_GT(front.parent, static_cast<int>(f));
    } else {
      EXPECT_TRUE(front.border.empty());
    }
  }
  EXPECT_EQ(next, static_cast<int>(body.cloud.size()));
  EXPECT_GT(dissection.fronts.size(), 3u);
}

TEST(StiffnessFactor, NodesInOnePlaceAreSolvedToo) {
  // Sixty nodes nowhere in particular, tied in a chain: dissection has nothing to go by.
  SymmetricBlockMatrix chain;
  chain.width = 3;
  for (int i = 0; i < 60; ++i) {
    for (int j = i; j < std::min(60, i + 2); ++j) {
      chain.pattern.columns.push_back(j);
      for (int k = 0; k < 9; ++k) {
        chain.blocks.push_back(k % 4 == 0 ? (i == j ? 2.5 : -1.0) : 0.0);
      }
    }
    chain.pattern.row_begin.push_back(chain.pattern.columns.size());
  }
  const auto factored = StiffnessFactor::factor(chain, std::vector<Vec3>(60, Vec3(1, 2, 3)));
  ASSERT_TRUE(factored) << factored.error().text();
  std::vector<double> solution(180, 1.0), product(180);
  ASSERT_TRUE(factored->solve(chain, solution, 1));
  chain.multiply(solution, product);
  for (const double value : product) EXPECT_NEAR(value, 1.0, 1e-12);
}

}  // namespace
}  // namespace viscera
