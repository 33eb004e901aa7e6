#include "kernels/hive/surface_walk.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "engine/verification/bodies.h"
#include "kernels/base/random.h"

namespace viscera {
namespace {

TriangleSurface scaled_cube(int divisions, const Vec3& sizes) {
  TriangleSurface surface = unit_cube(divisions);
  for (Vec3& vertex : surface.vertices) vertex = vertex.cwiseProduct(sizes);
  return surface;
}

TEST(SurfaceWalk, FindsTheSameNearestPlaceAsLookingEverywhere) {
  const auto surface = WalkableSurface::make(ringed_hemisphere(0.025, 24));
  ASSERT_TRUE(surface) << surface.error().text();
  const Random random(3, 1);
  SurfaceSpot spot = surface->nearest(Vec3(0, 0, 0.025));
  // A tip that wanders over the dome, out by up to 3 mm and in by up to 1 mm.
  for (int i = 0; i < 400; ++i) {
    const double t = 0.02 * i, across = 0.6 * std::sin(0.7 * t);
    Vec3 tip(std::cos(t) * std::sin(across), std::sin(t) * std::sin(across), std::cos(across));
    tip *= 0.025 + 0.004 * random.uniform(static_cast<std::uint64_t>(i)) - 0.001;
    ASSERT_EQ(surface->walk(tip, 0.01, spot), WalkEnd::kFound) << i;
    const SurfaceSpot expected = surface->nearest(tip);
    EXPECT_LT((spot.position - expected.position).norm(), 1e-12) << i;
    EXPECT_GT(spot.normal.dot(tip.normalized()), 0.99) << i;
  }
}

TEST(SurfaceWalk, DoesNotJumpToTheFarSideOfAThinBody) {
  const auto surface = WalkableSurface::make(scaled_cube(20, Vec3(0.04, 0.04, 0.001)));
  ASSERT_TRUE(surface);
  SurfaceSpot spot = surface->nearest(Vec3(0, 0, 0.001));
  ASSERT_GT(spot.normal.z(), 0.9);
  // The tip has gone three quarters through, and is nearer to the other side.
  for (int i = 0; i <= 30; ++i) {
    const Vec3 tip(0.0003 * i, 0.0001 * i, -0.00025);
    ASSERT_EQ(surface->walk(tip, 0.01, spot), WalkEnd::kFound);
    EXPECT_NEAR(spot.position.z(), 0.0005, 1e-12);
    EXPECT_LT(surface->nearest(tip).position.z(), 0.0);
  }
}

TEST(SurfaceWalk, SaysThatItIsLostAndStaysWhereItWas) {
  const auto surface = WalkableSurface::make(ringed_hemisphere(0.025, 12));
  ASSERT_TRUE(surface);
  SurfaceSpot spot = surface->nearest(Vec3(0, 0, 0.025));
  const Vec3 before = spot.position;
  EXPECT_EQ(surface->walk(Vec3(0, 0, 0.1), 0.01, spot), WalkEnd::kLost);
  EXPECT_EQ(surface->walk(Vec3(0, std::nan(""), 0), 0.01, spot), WalkEnd::kLost);
  EXPECT_EQ(spot.position, before);
  SurfaceSpot nowhere;
  EXPECT_EQ(surface->walk(Vec3(0, 0, 0.025), 0.01, nowhere), WalkEnd::kLost);
  EXPECT_EQ(surface->straight(Vec3(0.001, 0, 0), nowhere), WalkEnd::kLost);
}

TEST(SurfaceWalk, WalksOnADeformedSurfaceWithTheSameTriangles) {
  const auto surface = WalkableSurface::make(scaled_cube(10, Vec3::Constant(0.02)));
  ASSERT_TRUE(surface);
  std::vector<Vec3> moved = surface->surface().vertices;
  for (Vec3& vertex : moved) vertex += Vec3(0, 0, 0.004);
  SurfaceSpot spot = surface->nearest(Vec3(0, 0, 0.01));
  ASSERT_EQ(surface->walk(moved, {}, Vec3(0.003, 0.001, 0.015), 0.01, spot), WalkEnd::kFound);
  EXPECT_LT((spot.position - Vec3(0.003, 0.001, 0.014)).norm(), 1e-12);
  EXPECT_LT((surface->at(spot.point).position - Vec3(0.003, 0.001, 0.010)).norm(), 1e-12);
}

TEST(SurfaceWalk, StraightWaysAreGreatCirclesOfABall) {
  const auto surface = WalkableSurface::make(ringed_hemisphere(0.025, 48));
  ASSERT_TRUE(surface);
  const SurfaceSpot pole = surface->nearest(Vec3(0, 0, 0.025));
  for (int i = 0; i < 12; ++i) {
    const double angle = std::numbers::pi / 6.0 * i + 0.1;
    SurfaceSpot spot = pole;
    ASSERT_EQ(surface->straight(0.01 * Vec3(std::cos(angle), std::sin(angle), 0), spot),
              WalkEnd::kFound);
    const double polar = 0.4;  // 10 mm of 25 mm
    const Vec3 expected = 0.025 * Vec3(std::sin(polar) * std::cos(angle),
                                       std::sin(polar) * std::sin(angle), std::cos(polar));
    EXPECT_LT((spot.position - expected).norm(), 3e-4) << i;
  }
}

TEST(SurfaceWalk, AStraightWayLeavesAnOpenSurfaceAtItsEdge) {
  TriangleSurface sheet;
  sheet.vertices = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
  sheet.triangles = {{0, 1, 2}, {0, 2, 3}};
  const auto surface = WalkableSurface::make(sheet);
  ASSERT_TRUE(surface);
  SurfaceSpot spot = surface->nearest(Vec3(0.7, 0.3, 0));
  EXPECT_EQ(surface->straight(Vec3(-0.5, 0.4, 0), spot), WalkEnd::kFound);
  EXPECT_LT((spot.position - Vec3(0.2, 0.7, 0)).norm(), 1e-12);
  EXPECT_EQ(surface->straight(Vec3(-1, 0, 0), spot), WalkEnd::kEdge);
}

TEST(SurfaceWalk, RefusesSurfacesWithoutTwoSides) {
  TriangleSurface book;
  book.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}};
  book.triangles = {{0, 1, 2}, {1, 0, 3}, {0, 1, 4}};
  const auto three = WalkableSurface::make(book);
  ASSERT_FALSE(three);
  EXPECT_NE(three.error().text().find("between vertices 0 and 1"), std::string::npos);
  book.triangles = {{0, 1, 2}, {0, 1, 3}};
  const auto flipped = WalkableSurface::make(book);
  ASSERT_FALSE(flipped);
  EXPECT_NE(flipped.error().text().find("disagree"), std::string::npos);
  book.triangles = {{0, 1, 9}};
  EXPECT_FALSE(WalkableSurface::make(book));
  EXPECT_FALSE(WalkableSurface::make({}));
}

}  // namespace
}  // namespace viscera
