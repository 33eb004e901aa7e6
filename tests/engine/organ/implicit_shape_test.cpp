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

TEST(ImplicitShape, FoldsFurrowATubeAtTheirPitchAndBandsInterruptThem) {
  const std::vector<TubePoint> axis = {{{0, 0, 0}, 0.02}, {{0.1, 0, 0}, 0.02}, {{0.2, 0, 0}, 0.02}};
  GutFolds folds;
  folds.pitch = 0.03;
  folds.depth = 5e-3;
  const SignedDistance rings = folded_tube(axis, folds);
  // A fold every 30 mm, bulges between.
  EXPECT_NEAR(rings({0.09, 0.02, 0}), 5e-3, 1e-4);
  EXPECT_NEAR(rings({0.09, 0, -0.02}), 5e-3, 1e-4);
  EXPECT_NEAR(rings({0.105, 0.02, 0}), 0.0, 1e-4);
  folds.bands = 3;
  folds.band_depth = 2e-3;
  folds.band_width = 6e-3;
  const SignedDistance gut = folded_tube(axis, folds);
  const SignedDistance smooth = tube(axis);
  int banded = 0;
  for (int degree = 0; degree < 360; ++degree) {
    const double angle = degree * std::numbers::pi / 180.0;
    double least = 1.0, greatest = 0.0;
    for (double s = 0.08; s < 0.11; s += 1e-3) {
      const Vec3 at(s, 0.02 * std::cos(angle), 0.02 * std::sin(angle));
      least = std::min(least, gut(at) - smooth(at));
      greatest = std::max(greatest, gut(at) - smooth(at));
    }
    EXPECT_GE(least, 0.0);
    EXPECT_LE(greatest, 5e-3 + 1e-9);
    banded += greatest - least < 0.2e-3;  // a band is level along the tube
  }
  EXPECT_GT(banded, 3);
  EXPECT_LT(banded, 60);
}

TEST(ImplicitShape, FoldsLeaveTheDistanceFarFromTheTubeAlone) {
  const std::vector<TubePoint> axis = {{{0, 0, 0}, 0.02}, {{0.1, 0, 0}, 0.02}};
  GutFolds folds;
  folds.pitch = 0.03;
  folds.depth = 5e-3;
  EXPECT_DOUBLE_EQ(folded_tube(axis, folds)({0.05, 0.09, 0}), tube(axis)({0.05, 0.09, 0}));
}

TEST(ImplicitShape, LobulesOnlyAddAndStayUnderTheirHeight) {
  const SignedDistance flat = half_space(Vec3::Zero(), Vec3::UnitZ());
  const SignedDistance bumpy = lobulated(flat, 4e-3, 0.01, 3, 0);
  double least = 1.0, greatest = -1.0;
  for (int i = 0; i < 3000; ++i) {
    const Vec3 x(0.11 * std::sin(i), 0.13 * std::cos(1.7 * i), 0.0);
    EXPECT_LE(bumpy(x), 0.0);
    EXPECT_GE(bumpy(x), -4e-3);
    least = std::min(least, bumpy(x));
    greatest = std::max(greatest, bumpy(x));
    EXPECT_EQ(bumpy(x), lobulated(flat, 4e-3, 0.01, 3, 0)(x));
  }
  EXPECT_LT(least, -3e-3);
  EXPECT_GT(greatest, -1.5e-3);
}

TEST(ImplicitShape, MirrorSwapsTheSides) {
  const SignedDistance ball = ellipsoid({0.03, 0.01, 0}, {0.01, 0.01, 0.01});
  const SignedDistance other = mirrored(ball, 0);
  EXPECT_NEAR(other({-0.03, 0.02, 0}), 0.0, 1e-12);
  EXPECT_GT(other({0.03, 0.01, 0}), 0.0);
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
