#include "kernels/points/surface.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include "tests/support/shapes.h"

namespace viscera {
namespace {

TEST(Surface, CubeHasItsAreaAndVolumeWhereverItStands) {
  TriangleSurface cube = test::cube(0.1, 3);
  for (Vec3& vertex : cube.vertices) vertex += Vec3(5.0, -3.0, 7.0);
  EXPECT_NEAR(area(cube), 0.06, 1e-12);
  EXPECT_NEAR(volume(cube), 0.001, 1e-12);
  EXPECT_NEAR((bounds(cube).center() - Vec3(5.0, -3.0, 7.0)).norm(), 0.0, 1e-12);
}

TEST(Surface, VolumeOfAnInsideOutSurfaceIsNegative) {
  TriangleSurface cube = test::cube(0.1, 1);
  for (auto& triangle : cube.triangles) std::swap(triangle[0], triangle[1]);
  EXPECT_NEAR(volume(cube), -0.001, 1e-15);
}

TEST(Surface, SphereApproachesItsAreaAndVolume) {
  const TriangleSurface sphere = test::icosphere(0.05, 4);
  EXPECT_EQ(sphere.triangles.size(), 5120u);
  EXPECT_NEAR(area(sphere) / (4.0 * std::numbers::pi * 0.05 * 0.05), 1.0, 2e-3);
  EXPECT_NEAR(volume(sphere) / (4.0 / 3.0 * std::numbers::pi * std::pow(0.05, 3)), 1.0, 4e-3);
}

TEST(Surface, VertexNormalsOfASphereAreRadial) {
  const TriangleSurface sphere = test::icosphere(0.05, 3);
  const std::vector<Vec3> normals = vertex_normals(sphere);
  for (std::size_t v = 0; v < normals.size(); ++v) {
    EXPECT_GT(normals[v].dot(sphere.vertices[v].normalized()), 0.9999);
  }
}

TEST(Surface, NormalAtACubeCornerDoesNotDependOnHowItsFacesAreSplit) {
  // One face meets the corner with one triangle, another with two: area weights would tilt it.
  const TriangleSurface cube = test::cube(1.0, 1);
  const std::vector<Vec3> normals = vertex_normals(cube);
  for (std::size_t v = 0; v < normals.size(); ++v) {
    EXPECT_NEAR((normals[v] - cube.vertices[v].normalized()).norm(), 0.0, 1e-12);
  }
}

TEST(Surface, VertexAreasAddUpToTheArea) {
  const TriangleSurface sphere = test::icosphere(0.05, 3);
  const std::vector<double> areas = vertex_areas(sphere);
  EXPECT_NEAR(std::accumulate(areas.begin(), areas.end(), 0.0), area(sphere), 1e-12);
  EXPECT_GT(*std::min_element(areas.begin(), areas.end()), 0.0);
}

TEST(Surface, PositionFollowsTheBarycentricWeights) {
  const TriangleSurface cube = test::cube(2.0, 1);
  const auto& [a, b, c] = cube.triangles[3];
  const Vec3 expected = 0.2 * cube.vertices[a] + 0.3 * cube.vertices[b] + 0.5 * cube.vertices[c];
  EXPECT_NEAR((position(cube, {3, Vec3(0.2, 0.3, 0.5)}) - expected).norm(), 0.0, 1e-15);
}

TEST(Surface, EmptySurfaceHasNeitherAreaNorVolume) {
  EXPECT_EQ(area({}), 0.0);
  EXPECT_EQ(volume({}), 0.0);
  EXPECT_TRUE(bounds({}).isEmpty());
}

}  // namespace
}  // namespace viscera
