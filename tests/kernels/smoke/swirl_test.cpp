#include "kernels/smoke/swirl.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "kernels/base/random.h"

namespace viscera {
namespace {

Vec3 swirl_at(const SwirlField& field, double t, const Vec3f& position) {
  SwirlBlock block = {};
  block.x[5] = position.x();
  block.y[5] = position.y();
  block.z[5] = position.z();
  sum_swirl(field.waves(t), block);
  return {block.ax[5], block.ay[5], block.az[5]};
}

TEST(Swirl, HasTheAskedRootMeanSquare) {
  const Random random(9, 0);
  double sum = 0.0;
  const int samples = 20000;
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    const SwirlField field(seed, 1.5, 0.02, 0.6);
    for (int i = 0; i < samples / 4; ++i) {
      const Vec3f at(random.uniform(4 * i), random.uniform(4 * i + 1), random.uniform(4 * i + 2));
      sum += swirl_at(field, 10.0 * random.uniform(4 * i + 3), at).squaredNorm();
    }
  }
  EXPECT_NEAR(std::sqrt(sum / samples), 1.5, 0.05);
}

TEST(Swirl, HasNoDivergence) {
  const SwirlField field(4, 1.0, 0.02, 0.6);
  const float step = 2e-4f;
  const Random random(2, 0);
  double divergence = 0.0, gradient = 0.0;
  for (int i = 0; i < 200; ++i) {
    const Vec3f at =
        0.1f * Vec3f(random.uniform(3 * i), random.uniform(3 * i + 1), random.uniform(3 * i + 2));
    double trace = 0.0;
    for (int axis = 0; axis < 3; ++axis) {
      const Vec3 slope = (swirl_at(field, 0.3, at + step * Vec3f::Unit(axis)) -
                          swirl_at(field, 0.3, at - step * Vec3f::Unit(axis))) /
                         (2.0 * step);
      trace += slope[axis];
      gradient += slope.squaredNorm();
    }
    divergence += trace * trace;
  }
  EXPECT_LT(std::sqrt(divergence / gradient), 0.02);
}

TEST(Swirl, NeighboursMoveTogetherAndDistantOnesDoNot) {
  const SwirlField field(7, 1.0, 0.02, 0.6);
  const Random random(3, 0);
  double near = 0.0, far = 0.0, square = 0.0;
  for (int i = 0; i < 2000; ++i) {
    const Vec3f at(random.uniform(3 * i), random.uniform(3 * i + 1), random.uniform(3 * i + 2));
    const Vec3 here = swirl_at(field, 0.0, at);
    square += here.squaredNorm();
    near += here.dot(swirl_at(field, 0.0, at + Vec3f(5e-4f, 0.0f, 0.0f)));
    far += here.dot(swirl_at(field, 0.0, at + Vec3f(0.0f, 0.37f, 0.0f)));
  }
  EXPECT_GT(near / square, 0.9);
  EXPECT_LT(std::abs(far / square), 0.5);
}

TEST(Swirl, AddsNothingWithoutAmplitude) {
  EXPECT_EQ(swirl_at(SwirlField(1, 0.0, 0.02, 0.6), 1.0, Vec3f(0.1f, 0.2f, 0.3f)), Vec3::Zero());
}

}  // namespace
}  // namespace viscera
