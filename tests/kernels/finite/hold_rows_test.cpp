#include "kernels/finite/hold_rows.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "tests/kernels/finite/finite_cube.h"

namespace viscera {
namespace {

TEST(HoldRows, MultiplySeveralVectorsAsEachAlone) {
  const Cube cube = Cube::make(0.45);
  const HoldRows rows(*cube.system.hold());
  const std::size_t n = 3 * rows.nodes().size();
  std::mt19937 random(5);
  std::uniform_real_distribution<double> number(-1.0, 1.0);
  constexpr std::size_t kVectors = 5;  // three at once, and two more
  std::vector<double> all(kVectors * n), together;
  for (double& one : all) one = number(random);
  rows.multiply(all, together, kVectors);
  ASSERT_EQ(together.size(), kVectors * 4 * rows.nodes().size());
  for (std::size_t v = 0; v < kVectors; ++v) {
    const std::vector<double> one(all.begin() + static_cast<std::ptrdiff_t>(v * n),
                                  all.begin() + static_cast<std::ptrdiff_t>((v + 1) * n));
    std::vector<double> alone;
    rows.multiply(one, alone);
    for (std::size_t node = 0; node < rows.nodes().size(); ++node)
      for (std::size_t k = 0; k < 3; ++k)
        EXPECT_EQ(together[4 * (v * rows.nodes().size() + node) + k], alone[4 * node + k]);
  }
}

TEST(HoldRows, MultiplyAsTheMatrixThatTheyAreOf) {
  const Cube cube = Cube::make(0.45);
  const SymmetricBlockMatrix hold = *cube.system.hold();
  const HoldRows rows(hold);
  const std::size_t n = hold.pattern.rows();
  std::vector<double> all(3 * n), expected(3 * n), u, forces;
  for (std::size_t i = 0; i < all.size(); ++i)
    all[i] = std::sin(1.0 + 0.7 * static_cast<double>(i));
  hold.multiply(all, expected);
  const double largest =
      std::abs(*std::ranges::max_element(expected, {}, [](double x) { return std::abs(x); }));
  double unsymmetric = 0.0;
  rows.each([&](int row, int column, const Mat3& block) {
    if (row != column)
      unsymmetric = std::max(unsymmetric, (block - block.transpose()).norm() / block.norm());
  });
  ASSERT_GT(unsymmetric, 0.01) << "blocks that are the wrong way round would pass";
  for (const int node : rows.nodes())
    u.insert(u.end(), all.begin() + 3 * node, all.begin() + 3 * node + 3);
  rows.multiply(u, forces);
  for (std::size_t i = 0; i < u.size(); ++i)
    EXPECT_NEAR(forces[4 * (i / 3) + i % 3],
                expected[3 * static_cast<std::size_t>(rows.nodes()[i / 3]) + i % 3],
                100.0 * kSingle * largest);
  for (std::size_t node = 0; node < n; ++node)
    if (!std::ranges::binary_search(rows.nodes(), static_cast<int>(node))) {
      EXPECT_TRUE(Vec3::Map(expected.data() + 3 * node).isZero(0.0)) << node;
    }
}

}  // namespace
}  // namespace viscera
