#include "engine/organ/surface_quality.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "engine/organ/implicit_shapes.h"
#include "engine/organ/shape.h"
#include "tests/support/shapes.h"

namespace viscera::test {
namespace {

// A ring about z of these two radii.
TriangleSurface ring(double great, double small) {
  const SignedDistance distance = [=](const Vec3& x) {
    return std::hypot(std::hypot(x.x(), x.y()) - great, x.z()) - small;
  };
  const double reach = great + 1.3 * small;
  const auto surface = mesh_signed_distance(
      distance, Box(Vec3(-reach, -reach, -1.3 * small), Vec3(reach, reach, 1.3 * small)),
      0.6 * small);
  EXPECT_TRUE(surface);
  return *surface;
}

TEST(SurfaceQuality, OfABall) {
  const SurfaceQuality quality = measure_quality(icosphere(0.03, 4), 0.01);
  EXPECT_EQ(quality.genus, 0);
  // A ball's wall is its diameter everywhere.
  EXPECT_NEAR(quality.thinnest_wall, 0.06, 2e-3);
  EXPECT_EQ(quality.thin_share, 0.0);
  EXPECT_GT(quality.least_angle, 50.0 * std::numbers::pi / 180.0);
  EXPECT_GT(quality.shortest_edge, 0.0);
  EXPECT_LT(quality.longest_edge, 2.0 * quality.shortest_edge);
}

TEST(SurfaceQuality, ARingHasOneHandleAndItsOwnThickness) {
  const SurfaceQuality quality = measure_quality(ring(0.03, 0.006), 0.015);
  EXPECT_EQ(quality.genus, 1);
  EXPECT_NEAR(quality.thinnest_wall, 0.012, 1e-3);
  EXPECT_GT(quality.thin_share, 0.9);
}

TEST(SurfaceQuality, APlateIsAsThinAsItIs) {
  const SurfaceQuality quality = measure_quality(box({0.06, 0.06, 0.004}, 30), 5e-3);
  EXPECT_NEAR(quality.thinnest_wall, 0.004, 1e-4);
  EXPECT_GT(quality.thin_share, 0.8);
  EXPECT_EQ(measure_quality(box({0.06, 0.06, 0.004}, 30), 3e-3).thin_share, 0.0);
}

TEST(SurfaceQuality, OverlapIsAsDeepAsOneBodyLiesInTheOther) {
  const TriangleSurface ball = icosphere(0.03, 4);
  TriangleSurface other = ball;
  for (Vec3& x : other.vertices) x.x() += 0.05;
  // The two spheres' caps: each reaches 10 mm into the other.
  EXPECT_NEAR(greatest_overlap(ball, other).depth, 0.01, 5e-4);
  for (Vec3& x : other.vertices) x.x() += 0.0101;
  EXPECT_EQ(greatest_overlap(ball, other).depth, 0.0);
}

}  // namespace
}  // namespace viscera::test
