#include "kernels/points/surface_tree.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "kernels/base/random.h"
#include "tests/support/shapes.h"

namespace viscera {
namespace {

Vec3 random_place(const Random& random, std::uint64_t i, double half_edge) {
  return half_edge *
         (2.0 * Vec3(random.uniform(3 * i), random.uniform(3 * i + 1), random.uniform(3 * i + 2)) -
          Vec3::Ones());
}

/// Exact signed distance to a cube centred at the origin.
double cube_distance(const Vec3& x, double edge) {
  const Vec3 beyond = x.cwiseAbs() - Vec3::Constant(0.5 * edge);
  return beyond.cwiseMax(0.0).norm() + std::min(0.0, beyond.maxCoeff());
}

/// A star with sharp spikes and deep valleys, where the sign is hardest.
TriangleSurface star() {
  TriangleSurface surface = test::icosphere(1.0, 2);
  const Random random(7, 0);
  for (std::size_t v = 0; v < surface.vertices.size(); ++v) {
    surface.vertices[v] *= v % 3 == 0 ? 2.5 : 0.4 + 0.3 * random.uniform(v);
  }
  return surface;
}

/// Distance to a triangle, by its plane where that is inside and its edges elsewhere.
double triangle_distance(const Vec3& x, const std::array<Vec3, 3>& p) {
  const Vec3 normal = (p[1] - p[0]).cross(p[2] - p[0]).normalized();
  double nearest = std::numeric_limits<double>::infinity();
  bool over = true;
  for (int i = 0; i < 3; ++i) {
    const Vec3 edge = p[(i + 1) % 3] - p[i];
    over = over && edge.cross(x - p[i]).dot(normal) >= 0.0;
    const double share = std::clamp(edge.dot(x - p[i]) / edge.squaredNorm(), 0.0, 1.0);
    nearest = std::min(nearest, (x - p[i] - share * edge).norm());
  }
  return over ? std::abs(normal.dot(x - p[0])) : nearest;
}

/// Inside or outside by the solid angle that the surface fills [VanOosterom1983].
bool inside_by_winding(const TriangleSurface& surface, const Vec3& x) {
  double angle = 0.0;
  for (const auto& [i, j, k] : surface.triangles) {
    const Vec3 a = surface.vertices[i] - x, b = surface.vertices[j] - x,
               c = surface.vertices[k] - x;
    const double la = a.norm(), lb = b.norm(), lc = c.norm();
    angle += 2.0 * std::atan2(a.dot(b.cross(c)),
                              la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb);
  }
  return angle > 2.0 * std::numbers::pi;
}

TEST(SurfaceTree, SignedDistanceToACubeIsExactForFacesEdgesAndCorners) {
  const SurfaceTree tree(test::cube(0.1, 3));
  const Random random(1, 0);
  for (int i = 0; i < 5000; ++i) {
    const Vec3 x = random_place(random, i, 0.1);
    ASSERT_NEAR(tree.signed_distance(x), cube_distance(x, 0.1), 1e-14) << x.transpose();
  }
}

TEST(SurfaceTree, SignedDistanceToASpikyStarMatchesBruteForceAndTheWindingNumber) {
  const TriangleSurface surface = star();
  const SurfaceTree tree(surface);
  const Random random(2, 0);
  int inside = 0;
  for (int i = 0; i < 3000; ++i) {
    const Vec3 x = random_place(random, i, 2.0);
    double nearest = std::numeric_limits<double>::infinity();
    for (const auto& [a, b, c] : surface.triangles) {
      nearest = std::min(nearest, triangle_distance(x, {surface.vertices[a], surface.vertices[b],
                                                        surface.vertices[c]}));
    }
    const bool is_inside = inside_by_winding(surface, x);
    inside += is_inside;
    ASSERT_NEAR(tree.signed_distance(x), is_inside ? -nearest : nearest, 1e-12) << x.transpose();
  }
  EXPECT_GT(inside, 100);
}

TEST(SurfaceTree, ClosestPointLiesOnItsTriangleAtItsDistance) {
  const TriangleSurface surface = star();
  const SurfaceTree tree(surface);
  const Random random(3, 0);
  for (int i = 0; i < 1000; ++i) {
    const Vec3 x = random_place(random, i, 3.0);
    const SurfaceTree::Closest closest = tree.closest(x);
    EXPECT_NEAR((position(surface, closest.point) - closest.position).norm(), 0.0, 1e-12);
    EXPECT_NEAR((x - closest.position).norm(), closest.distance, 1e-12);
    EXPECT_GE(closest.point.weights.minCoeff(), 0.0);
    EXPECT_NEAR(closest.point.weights.sum(), 1.0, 1e-12);
  }
}

TEST(SurfaceTree, AWayEntersLaterThanAShareWhereItsCrossingsSaySo) {
  const SurfaceTree tree(star()), other(test::cube(1.0, 4));
  const Random random(4, 0);
  std::vector<SurfaceTree::Crossing> found;
  int entering = 0;
  for (int i = 0; i < 4000; ++i) {
    const Vec3 from = random_place(random, 2 * i, 2.0), to = random_place(random, 2 * i + 1, 2.0);
    const double share = random.uniform(1'000'000 + i);
    for (const SurfaceTree* one : {&tree, &other}) {
      one->crossings(from, to, found);
      const bool enters = std::ranges::any_of(
          found, [&](const auto& crossing) { return crossing.enters && crossing.share > share; });
      ASSERT_EQ(one->enters_after(share, from, to), enters) << i;
      entering += enters;
    }
  }
  EXPECT_GT(entering, 400);
}

TEST(SurfaceTree, VerticesAreTheirOwnClosestPoints) {
  const TriangleSurface surface = star();
  const SurfaceTree tree(surface);
  for (const Vec3& vertex : surface.vertices) EXPECT_LT(tree.closest(vertex).distance, 1e-14);
}

TEST(SurfaceTree, CoincidentCentresAndFlatTrianglesDoNoHarm) {
  // Ten copies of a triangle, and one collapsed to a segment that is nearest to the query.
  TriangleSurface surface;
  surface.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 2}, {1, 0, 2}, {0.5, 0, 2}};
  surface.triangles.assign(10, {0, 1, 2});
  surface.triangles.push_back({3, 4, 5});
  const SurfaceTree tree(surface);
  const SurfaceTree::Closest closest = tree.closest({0.7, 0.3, 2.0});
  EXPECT_EQ(closest.point.triangle, 10);
  EXPECT_NEAR(closest.distance, 0.3, 1e-14);
}

TEST(SurfaceTree, EmptySurfaceIsInfinitelyFar) {
  const SurfaceTree tree{TriangleSurface{}};
  EXPECT_EQ(tree.closest(Vec3::Zero()).point.triangle, -1);
  EXPECT_TRUE(std::isinf(tree.signed_distance(Vec3::Zero())));
}

TEST(SurfaceTree, CrossingsTellInsideFromOutsideAlongAnyWay) {
  const TriangleSurface surface = star();
  const SurfaceTree tree(surface);
  const Random random(5, 0);
  std::vector<SurfaceTree::Crossing> found;
  int crossed = 0;
  for (int i = 0; i < 2000; ++i) {
    const Vec3 from = random_place(random, 2 * i, 2.0), to = random_place(random, 2 * i + 1, 2.0);
    tree.crossings(from, to, found);
    bool inside = inside_by_winding(surface, from);
    double share = -1.0;
    for (const SurfaceTree::Crossing& one : found) {
      EXPECT_GE(one.share, share);
      share = one.share;
      EXPECT_EQ(one.enters, !inside) << i;
      inside = one.enters;
      ++crossed;
    }
    EXPECT_EQ(inside, inside_by_winding(surface, to)) << i;
  }
  EXPECT_GT(crossed, 1000);
}

TEST(SurfaceTree, WaysDoNotSlipBetweenTriangles) {
  // Through the diagonals, edges and corners of a cube's squares, and along its faces' rims.
  const SurfaceTree tree(test::cube(2.0, 2));
  std::vector<SurfaceTree::Crossing> found;
  const auto crossings = [&](const Vec3& from, const Vec3& to) {
    tree.crossings(from, to, found);
    return found.size();
  };
  EXPECT_GE(crossings({0.5, 0.5, 0.0}, {0.5, 0.5, 2.0}), 1u);
  EXPECT_GE(crossings({0.0, 0.0, 0.0}, {0.0, 0.0, 2.0}), 1u);
  EXPECT_GE(crossings({0.3, 0.0, 0.0}, {0.3, 0.0, 2.0}), 1u);
  EXPECT_GE(crossings({1.5, 0.3, 1.0}, {0.5, 0.3, 1.0}), 1u);
  EXPECT_TRUE(found.front().enters);
  // Triangles that it runs along don't count.
  EXPECT_EQ(crossings({-0.5, 0.2, 1.0}, {0.5, 0.3, 1.0}), 0u);
  // An end on the surface does, from either side.
  EXPECT_GE(crossings({0.3, 0.4, 0.0}, {0.3, 0.4, 1.0}), 1u);
  EXPECT_FALSE(found.front().enters);
  EXPECT_GE(crossings({0.3, 0.4, 2.0}, {0.3, 0.4, 1.0}), 1u);
  EXPECT_TRUE(found.front().enters);
}

TEST(SurfaceTree, TrianglesWithinARadiusAreThoseOfABruteSearch) {
  const TriangleSurface surface = star();
  const SurfaceTree tree(surface);
  const Random random(6, 0);
  std::vector<int> found;
  for (int i = 0; i < 300; ++i) {
    const Vec3 x = random_place(random, i, 2.0);
    const double radius = 0.2 + random.uniform(1000 + i);
    tree.within(x, radius, found);
    std::vector<int> expected;
    for (int t = 0; t < static_cast<int>(surface.triangles.size()); ++t) {
      const auto& [a, b, c] = surface.triangles[t];
      if (triangle_distance(x, {surface.vertices[a], surface.vertices[b], surface.vertices[c]}) <
          radius)
        expected.push_back(t);
    }
    EXPECT_EQ(found, expected);
  }
}

}  // namespace
}  // namespace viscera
