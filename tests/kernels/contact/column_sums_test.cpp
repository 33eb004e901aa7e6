#include "kernels/contact/column_sums.h"

#include <gtest/gtest.h>

#include "kernels/base/random.h"

namespace viscera {
namespace {

struct Columns {
  std::size_t rows;
  std::vector<float> values;

  Columns(std::size_t rows_, std::size_t triples) : rows(rows_), values(3 * triples * rows_) {
    const Random random(8, 6);
    for (std::size_t i = 0; i < values.size(); ++i) {
      values[i] = static_cast<float>(random.normal(i));
    }
  }
  ColumnTriples all() const { return {values.data(), rows, rows}; }
  double at(std::size_t row, int triple, int axis) const {
    return values[static_cast<std::size_t>(3 * triple + axis) * rows + row];
  }
};

TEST(ColumnSums, AreTheColumnsTimesTheLoads) {
  // Longer than a chunk of rows and not a multiple of a register; odd and even numbers of triples.
  const Columns columns(4333, 6);
  for (const std::vector<int>& triples :
       {std::vector<int>{}, {2}, {0, 5}, {1, 3, 4}, {0, 1, 2, 3, 4, 5}}) {
    std::vector<Vec3> loads;
    for (const int t : triples) loads.emplace_back(1.0 + t, -0.5 * t, 2.0 - t);
    std::vector<float> sums;
    sum_column_triples(columns.all(), triples, loads, sums);
    ASSERT_EQ(sums.size(), columns.rows);
    for (std::size_t row = 0; row < columns.rows; ++row) {
      double exact = 0.0;
      for (std::size_t j = 0; j < triples.size(); ++j) {
        for (int a = 0; a < 3; ++a) exact += columns.at(row, triples[j], a) * loads[j][a];
      }
      ASSERT_NEAR(sums[row], exact, 1e-4);
    }
  }
}

TEST(ColumnSums, OfSeveralLoadsAreThoseOfEach) {
  constexpr std::size_t kFirst = 40, kRows = 1029;  // a part of the columns' rows
  const Columns columns(1500, 6);
  for (const std::vector<int>& triples : {std::vector<int>{}, {2}, {1, 3, 4}, {0, 1, 2, 5}}) {
    std::vector<Eigen::Matrix3Xf> loads;
    for (int c = 0; c < 3; ++c) {
      Eigen::Matrix3Xf load(3, static_cast<Eigen::Index>(triples.size()));
      for (Eigen::Index j = 0; j < load.cols(); ++j)
        load.col(j) = Vec3f(1.0f + static_cast<float>(j), 0.3f * static_cast<float>(c), -2.0f);
      loads.push_back(load);
    }
    std::vector<float> sums(3 * kRows, 5.0f);
    add_column_triples({columns.values.data() + kFirst, kRows, columns.rows}, triples, loads,
                       sums.data());
    for (std::size_t c = 0; c < 3; ++c)
      for (std::size_t row = 0; row < kRows; ++row) {
        double exact = 5.0;
        for (std::size_t j = 0; j < triples.size(); ++j)
          for (int a = 0; a < 3; ++a)
            exact +=
                columns.at(kFirst + row, triples[j], a) * loads[c](a, static_cast<Eigen::Index>(j));
        ASSERT_NEAR(sums[c * kRows + row], exact, 1e-4);
      }
  }
}

TEST(ColumnSums, WeightedTriplesAreThatAxisByAxis) {
  const Columns columns(2100, 5);
  for (const std::vector<int>& triples : {std::vector<int>{}, {3}, {0, 4}, {0, 1, 2, 3, 4}}) {
    std::vector<double> weights;
    for (const int t : triples) weights.push_back(0.3 + 0.1 * t);
    std::vector<float> sums(3 * columns.rows, 7.0f);
    sum_weighted_triples(columns.all(), triples, weights, sums.data());
    for (std::size_t row = 0; row < columns.rows; ++row) {
      for (int a = 0; a < 3; ++a) {
        double exact = 0.0;
        for (std::size_t j = 0; j < triples.size(); ++j) {
          exact += columns.at(row, triples[j], a) * weights[j];
        }
        ASSERT_NEAR(sums[static_cast<std::size_t>(a) * columns.rows + row], exact, 1e-5);
      }
    }
  }
}

}  // namespace
}  // namespace viscera
