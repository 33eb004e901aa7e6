#include "kernels/finite/hold_rows.h"

#include <gtest/gtest.h>

#include <random>

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
  std::vector<double> u(3 * rows.nodes().size()), forces;
  for (std::size_t i = 0; i < u.size(); ++i) u[i] = std::sin(1.0 + 0.7 * static_cast<double>(i));
  rows.multiply(u, forces);
  std::vector<double> expected(u.size(), 0.0);
  double largest = 0.0;
  const auto number = [&](int node) {
    return static_cast<std::size_t>(std::ranges::lower_bound(rows.nodes(), node) -
                                    rows.nodes().begin());
  };
  rows.each([&](int row, int column, const Mat3& block) {
    const std::size_t i = number(row), j = number(column);
    Vec3::Map(expected.data() + 3 * i) += block * Vec3::Map(u.data() + 3 * j);
    if (i != j)
      Vec3::Map(expected.data() + 3 * j) += block.transpose() * Vec3::Map(u.data() + 3 * i);
    largest = std::max(largest, block.cwiseAbs().maxCoeff());
  });
  for (std::size_t i = 0; i < u.size(); ++i)
    EXPECT_NEAR(forces[4 * (i / 3) + i % 3], expected[i], 1e-12 * largest * 100.0);
}

}  // namespace
}  // namespace viscera
