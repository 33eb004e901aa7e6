#include "kernels/points/surface_checks.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <string>
#include <vector>

#include "tests/support/shapes.h"

namespace viscera {
namespace {

/// One list of phrases for each defect expected, in order.
using Phrases = std::vector<std::string>;

void expect_defects(const TriangleSurface& surface, const std::vector<Phrases>& expected) {
  const std::vector<std::string> defects = surface_defects(surface);
  for (std::size_t i = 0; i < std::max(defects.size(), expected.size()); ++i) {
    const std::string defect = i < defects.size() ? defects[i] : "nothing";
    ASSERT_LT(i, expected.size()) << "found besides: " << defect;
    for (const std::string& phrase : expected[i]) {
      EXPECT_NE(defect.find(phrase), std::string::npos) << phrase << " in: " << defect;
    }
  }
}

TEST(SurfaceChecks, SoundSurfacesHaveNoDefects) {
  expect_defects(test::icosphere(0.05, 3), {});
  expect_defects(test::cube(0.1, 4), {});
}

TEST(SurfaceChecks, UnusedVerticesAreNoDefect) {
  TriangleSurface cube = test::cube(0.1, 1);
  cube.vertices.emplace_back(1.0, 1.0, 1.0);
  expect_defects(cube, {});
}

TEST(SurfaceChecks, EmptySurfaceIsRefused) {
  expect_defects({}, {{"empty"}});
}

TEST(SurfaceChecks, IndexOutOfRangeNamesTheTriangle) {
  TriangleSurface cube = test::cube(0.1, 1);
  cube.triangles[5][1] = 8;
  cube.triangles[7][2] = -1;
  expect_defects(cube, {{"index out of range: 2 triangles", "the first is 5", "expected 0 to 7"}});
}

TEST(SurfaceChecks, NonFiniteCoordinateNamesTheVertex) {
  TriangleSurface cube = test::cube(0.1, 1);
  cube.vertices[3].y() = std::numeric_limits<double>::quiet_NaN();
  expect_defects(cube, {{"non-finite", "the first is 3"}});
}

TEST(SurfaceChecks, MissingTriangleIsThreeOpenEdgesAndThePlaceIsInMillimetres) {
  TriangleSurface cube = test::cube(0.1, 2);
  cube.triangles.erase(cube.triangles.begin());
  expect_defects(cube, {{"open: 3 boundary edges", "between vertices 0 (-50, -50, -50 mm)"}});
}

TEST(SurfaceChecks, ThirdTriangleOnAnEdgeIsNonManifold) {
  TriangleSurface cube = test::cube(0.1, 1);
  const auto [a, b, c] = cube.triangles[0];
  cube.vertices.emplace_back(0.3, 0.3, 0.3);
  cube.triangles.push_back({b, a, 8});
  expect_defects(cube, {{"open: 2 boundary edges"}, {"non-manifold: 1 edge ", "vertices 0"}});
}

TEST(SurfaceChecks, OneTurnedTriangleIsInconsistent) {
  TriangleSurface cube = test::cube(0.1, 1);
  std::swap(cube.triangles[4][0], cube.triangles[4][1]);
  expect_defects(cube, {{"inconsistent orientation: 3 edges"}});
}

TEST(SurfaceChecks, InsideOutSurfaceIsNamedWithItsVolume) {
  TriangleSurface cube = test::cube(0.1, 1);
  for (auto& triangle : cube.triangles) std::swap(triangle[0], triangle[1]);
  expect_defects(cube, {{"inside-out", "-1000 ml"}});
}

TEST(SurfaceChecks, TwoPiecesAreCounted) {
  TriangleSurface two = test::cube(0.1, 1);
  const TriangleSurface other = test::cube(0.1, 1);
  for (const Vec3& vertex : other.vertices) two.vertices.push_back(vertex + Vec3(1.0, 0.0, 0.0));
  for (const auto& [a, b, c] : other.triangles) two.triangles.push_back({a + 8, b + 8, c + 8});
  expect_defects(two, {{"disconnected: 2 pieces", "triangle 12"}});
}

TEST(SurfaceChecks, PiecesThatTouchInAVertexAreTwo) {
  TriangleSurface two = test::cube(0.1, 1);
  const TriangleSurface other = two;
  // The other cube's vertex 0 is this one's opposite corner.
  int opposite = 0;
  for (int v = 0; v < 8; ++v) {
    if ((two.vertices[v] + other.vertices[0]).norm() < 1e-12) opposite = v;
  }
  for (const Vec3& vertex : other.vertices) two.vertices.push_back(vertex + Vec3::Constant(0.1));
  const auto renumber = [&](int v) { return v == 0 ? opposite : v + 8; };
  for (const auto& [a, b, c] : other.triangles) {
    two.triangles.push_back({renumber(a), renumber(b), renumber(c)});
  }
  expect_defects(two, {{"disconnected: 2 pieces"}});
}

TEST(SurfaceChecks, FlatTriangleIsNamedWithItsVertices) {
  // An edge's middle joined to the surface: closed, but one triangle has no area.
  TriangleSurface cube = test::cube(0.1, 1);
  const auto [a, b, c] = cube.triangles[0];
  cube.vertices.push_back(0.5 * (cube.vertices[a] + cube.vertices[b]));
  cube.triangles[0] = {a, 8, c};
  cube.triangles.push_back({8, b, c});
  cube.triangles.push_back({a, b, 8});
  expect_defects(cube, {{"zero area: 1 triangle", "the first is 13"}});
}

TEST(SurfaceChecks, AllDefectsAreListedTogether) {
  TriangleSurface cube = test::cube(0.1, 2);
  std::swap(cube.triangles[20][0], cube.triangles[20][1]);
  cube.triangles.erase(cube.triangles.begin());
  expect_defects(cube, {{"open"}, {"inconsistent orientation"}});
}

}  // namespace
}  // namespace viscera
