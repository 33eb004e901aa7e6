#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "engine/organ/implicit_shapes.h"

namespace viscera {
namespace {

// Length of the gradient, by central differences.
double slope(const SignedDistance& field, const Vec3& x) {
  constexpr double kStep = 1e-6;
  Vec3 gradient;
  for (int axis = 0; axis < 3; ++axis) {
    const Vec3 step = kStep * Vec3::Unit(axis);
    gradient[axis] = (field(x + step) - field(x - step)) / (2.0 * kStep);
  }
  return gradient.norm();
}

TEST(ImplicitShape, EllipsoidIsZeroOnItsSurfaceWithSlopeOne) {
  const Vec3 radii(0.03, 0.05, 0.02);
  const SignedDistance body = ellipsoid(Vec3::Zero(), radii);
  for (int i = 0; i < 20; ++i) {
    const Vec3 x =
        radii.cwiseProduct(Vec3(std::cos(i), std::sin(i), std::sin(3.0 * i)).normalized());
    EXPECT_NEAR(body(x), 0.0, 1e-12);
    EXPECT_NEAR(slope(body, x), 1.0, 1e-3);
  }
  EXPECT_LT(body(Vec3::Zero()), 0.0);
}

TEST(ImplicitShape, StraightTubeIsACapsule) {
  const SignedDistance body = tube({{{0, 0, 0}, 0.01}, {{0.04, 0, 0}, 0.01}});
  EXPECT_NEAR(body({0.013, 0.03, 0}), 0.02, 1e-9);
  EXPECT_NEAR(body({-0.03, 0, 0}), 0.02, 1e-9);
  EXPECT_NEAR(body({0.05, 0, 0}), 0.0, 1e-9);
}

TEST(ImplicitShape, BentTubeHasNoCreases) {
  const SignedDistance body =
      tube({{{-0.03, 0, 0}, 0.01}, {{0, 0.01, 0}, 0.014}, {{0.03, 0, 0}, 0.008}});
  for (double x = -0.025; x < 0.025; x += 1.3e-3) {
    const Vec3 at(x, 0.02, 0.004);
    const double h = 1e-5;
    const double bend =
        (body(at + h * Vec3::UnitX()) - 2.0 * body(at) + body(at - h * Vec3::UnitX())) / (h * h);
    EXPECT_LT(std::abs(bend), 200.0) << x;  // a crease of 1 degree would give 1700 / m
  }
}

TEST(ImplicitShape, SmoothJoinFillsTheCreaseAndLeavesTheRestAlone) {
  const SignedDistance floor = half_space({0, 0, 0}, {0, 0, 1});
  const SignedDistance wall = half_space({0, 0, 0}, {1, 0, 0});
  const SignedDistance both = join(floor, wall, 0.01);
  EXPECT_LT(both({0, 0, 0}), 0.0);
  EXPECT_DOUBLE_EQ(both({0.02, 0, 0}), 0.0);
  const SignedDistance cut = subtract(floor, wall, 0.0);
  EXPECT_DOUBLE_EQ(cut({-0.01, 0, -0.02}), 0.01);
  EXPECT_DOUBLE_EQ(cut({0.01, 0, -0.02}), -0.01);
}

TEST(ImplicitShape, NoiseStaysNearItsAmplitudeAndFollowsItsSeed) {
  const SignedDistance flat = half_space(Vec3::Zero(), Vec3::UnitZ());
  const SignedDistance one = roughened(flat, 1e-3, 0.03, 7, 0);
  const SignedDistance again = roughened(flat, 1e-3, 0.03, 7, 0);
  const SignedDistance other = roughened(flat, 1e-3, 0.03, 8, 0);
  double sum2 = 0.0;
  int differing = 0;
  constexpr int kPoints = 2000;
  for (int i = 0; i < kPoints; ++i) {
    const Vec3 x(0.11 * std::sin(i), 0.13 * std::cos(1.7 * i), 0.0);
    EXPECT_EQ(one(x), again(x));
    EXPECT_LE(std::abs(one(x)), 2e-3);
    differing += one(x) != other(x);
    sum2 += one(x) * one(x);
  }
  EXPECT_NEAR(std::sqrt(sum2 / kPoints), 0.5e-3, 0.1e-3);
  EXPECT_GT(differing, kPoints / 2);
}

TEST(ImplicitShape, BendAndTaperMoveTheSurfaceAsDescribed) {
  const SignedDistance rod = tube({{{-0.04, 0, 0}, 0.01}, {{0.04, 0, 0}, 0.01}});
  const SignedDistance bow = bent(rod, 0, 2, 0.0, 0.1);
  EXPECT_NEAR(bow({0.02, 0, 0.01 + 0.02 * 0.02 / 0.2}), 0.0, 1e-9);
  Taper taper;
  taper.from = -0.02;
  taper.to = 0.02;
  taper.to_scale = 0.5;
  const SignedDistance cone = tapered(rod, taper);
  EXPECT_NEAR(cone({-0.03, 0.01, 0}), 0.0, 1e-9);
  EXPECT_NEAR(cone({0.0, 0.0075, 0}), 0.0, 1e-9);
  EXPECT_NEAR(cone({0.03, 0.005, 0}), 0.0, 1e-9);
}

}  // namespace
}  // namespace viscera
