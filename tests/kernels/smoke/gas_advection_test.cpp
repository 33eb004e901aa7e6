#include "kernels/smoke/gas_advection.h"

#include <gtest/gtest.h>

#include <cmath>

#include "kernels/base/random.h"

namespace viscera {
namespace {

GasFaces faces_of(const GasLayout& layout, float value) {
  GasFaces faces;
  for (auto& values : faces) values.assign(static_cast<std::size_t>(layout.count), value);
  return faces;
}

TEST(GasAdvection, UniformFlowIsKeptToTheBit) {
  const GasLayout layout({9, 7, 5});
  GasFaces velocity = faces_of(layout, 0.0f);
  for (int axis = 0; axis < 3; ++axis) {
    const float u = 0.1f + 0.37f * static_cast<float>(axis);
    for (int k = 0; k < layout.faces(axis, 2); ++k) {
      for (int j = 0; j < layout.faces(axis, 1); ++j) {
        for (int i = 0; i < layout.faces(axis, 0); ++i) {
          velocity[axis][static_cast<std::size_t>(layout.index(i, j, k))] = u;
        }
      }
    }
  }
  const GasFaces before = velocity;
  GasAdvection advection;
  for (const double dt : {1e-3, 0.1, 10.0}) {
    advection.step(layout, faces_of(layout, 1.0f), Vec3(0.01, 0.02, 0.01), dt, velocity);
    for (int axis = 0; axis < 3; ++axis) {
      for (int k = 0; k < layout.faces(axis, 2); ++k) {
        for (int j = 0; j < layout.faces(axis, 1); ++j) {
          for (int i = 0; i < layout.faces(axis, 0); ++i) {
            const auto f = static_cast<std::size_t>(layout.index(i, j, k));
            ASSERT_EQ(velocity[axis][f], before[axis][f]) << "dt " << dt;
          }
        }
      }
    }
  }
}

TEST(GasAdvection, NoValueLeavesTheRangeOfThoseBefore) {
  const GasLayout layout({8, 8, 8});
  const Random random(4, 0);
  GasFaces velocity = faces_of(layout, 0.0f);
  std::uint64_t next = 0;
  for (auto& values : velocity) {
    for (float& u : values) u = static_cast<float>(random.uniform(next++) - 0.5);
  }
  GasAdvection advection;
  for (const double dt : {1e-3, 1.0, 1e6}) {
    advection.step(layout, faces_of(layout, 1.0f), Vec3::Constant(0.01), dt, velocity);
    for (const auto& values : velocity) {
      for (const float u : values) EXPECT_LE(std::abs(u), 0.5f);
    }
  }
}

TEST(GasAdvection, FacesThatNothingPassesKeepTheirValue) {
  const GasLayout layout({8, 8, 8});
  GasFaces velocity = faces_of(layout, 0.3f), passes = faces_of(layout, 1.0f);
  const auto wall = static_cast<std::size_t>(layout.index(4, 4, 4));
  passes[1][wall] = 0.0f;
  velocity[1][wall] = -2.0f;
  GasAdvection().step(layout, passes, Vec3::Constant(0.01), 0.02, velocity);
  EXPECT_EQ(velocity[1][wall], -2.0f);
}

// A smooth bump of transverse velocity, carried by a uniform stream along x over a quarter of the
// box: the error, most at its top, which the bounds cut, falls with the square of the spacing.
TEST(GasAdvection, ABumpIsCarriedWithSecondOrder) {
  const auto error = [](int n) {
    const GasLayout layout({n, 3, 3});
    GasFaces velocity = faces_of(layout, 0.0f);
    const auto bump = [](double x) { return 0.01 * std::exp(-std::pow((x - 0.35) / 0.1, 2)); };
    for (int k = -1; k <= 3; ++k) {
      for (int j = -1; j <= 3; ++j) {
        for (int i = -1; i <= n; ++i) {
          const auto f = static_cast<std::size_t>(layout.index(i, j, k));
          velocity[0][f] = 1.0f;
          velocity[2][f] = static_cast<float>(bump((i + 0.5) / n));
        }
      }
    }
    const int steps = n / 2;
    GasAdvection advection;
    const GasFaces passes = faces_of(layout, 1.0f);
    // w varies along x alone, and its own way along z changes nothing.
    for (int step = 0; step < steps; ++step) {
      advection.step(layout, passes, Vec3::Constant(1.0 / n), 0.25 / steps, velocity);
    }
    double worst = 0.0;
    for (int i = 0; i < n; ++i) {
      const double exact = bump((i + 0.5) / n - 0.25);
      const auto f = static_cast<std::size_t>(layout.index(i, 1, 1));
      worst = std::max(worst, std::abs(static_cast<double>(velocity[2][f]) - exact));
    }
    return worst / 0.01;
  };
  const double coarse = error(32), fine = error(64);
  EXPECT_LT(fine, 0.04);
  EXPECT_GT(std::log2(coarse / fine), 1.7);
}

}  // namespace
}  // namespace viscera
