#include "kernels/points/closest_on_triangle.h"

#include <gtest/gtest.h>

namespace viscera::test {
namespace {

const Vec3 kA(0, 0, 0), kB(2, 0, 0), kC(0, 1, 0);

Vec3 place(const Vec3& weights) {
  return weights[0] * kA + weights[1] * kB + weights[2] * kC;
}

TEST(ClosestOnTriangle, WeightsOfCornersThatDoNotMatterAreExactlyZero) {
  EXPECT_EQ(closest_weights({-1, -1, 3}, kA, kB, kC), Vec3(1, 0, 0));
  EXPECT_EQ(closest_weights({4, -1, 0}, kA, kB, kC), Vec3(0, 1, 0));
  EXPECT_EQ(closest_weights({-1, 3, 1}, kA, kB, kC), Vec3(0, 0, 1));
  EXPECT_EQ(closest_weights({0.5, -2, 1}, kA, kB, kC), Vec3(0.75, 0.25, 0));
  EXPECT_EQ(closest_weights({-2, 0.5, 1}, kA, kB, kC)[1], 0.0);
  EXPECT_EQ(closest_weights({2, 2, -1}, kA, kB, kC)[0], 0.0);
}

TEST(ClosestOnTriangle, NoOtherPlaceOfTheTriangleIsNearer) {
  constexpr int kSteps = 24;
  for (const Vec3& p : {Vec3(0.4, 0.2, 0.7), Vec3(1.5, 1.5, 0.3), Vec3(-0.3, 0.4, 0.2),
                        Vec3(1.1, -0.6, -0.5), Vec3(3.0, 0.1, 0.0), Vec3(-0.2, 1.7, 0.4)}) {
    const double found = (place(closest_weights(p, kA, kB, kC)) - p).norm();
    double least = 1e9;
    for (int i = 0; i <= kSteps; ++i)
      for (int k = 0; i + k <= kSteps; ++k) {
        const double u = double(i) / kSteps, v = double(k) / kSteps;
        least = std::min(least, (place({1 - u - v, u, v}) - p).norm());
      }
    EXPECT_LE(found, least + 1e-12);
    EXPECT_GT(found, least - 0.1);
  }
}

}  // namespace
}  // namespace viscera::test
