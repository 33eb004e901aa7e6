#include "kernels/points/surface_scan.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "kernels/base/random.h"
#include "kernels/points/surface_tree.h"
#include "tests/support/shapes.h"

namespace viscera {
namespace {

std::vector<Vec3f> in_single_precision(const TriangleSurface& surface) {
  std::vector<Vec3f> positions;
  for (const Vec3& vertex : surface.vertices) positions.push_back(vertex.cast<float>());
  return positions;
}

TEST(SurfaceScan, FindsOnAMovedSurfaceWhatAHierarchyOfItFinds) {
  const TriangleSurface rest = test::icosphere(0.05, 3);
  TriangleSurface moved = rest;
  for (Vec3& vertex : moved.vertices)
    vertex = Vec3(0.2, -0.1, 0.3) + vertex.cwiseProduct(Vec3(1.0, 0.4, 1.5));
  const std::vector<Vec3f> positions = in_single_precision(moved);
  for (std::size_t v = 0; v < positions.size(); ++v)
    moved.vertices[v] = positions[v].cast<double>();
  const SurfaceScan scan(rest);
  const SurfaceTree tree(moved);
  const Random random(17, 0);
  int near = 0;
  for (std::uint64_t i = 0; i < 400; ++i) {
    const Vec3 share(random.uniform(3 * i), random.uniform(3 * i + 1), random.uniform(3 * i + 2));
    const Vec3 query = Vec3(0.2, -0.1, 0.3) + 0.2 * (share - Vec3::Constant(0.5));
    const SurfaceTree::Closest expected = tree.closest(query);
    const auto found = scan.closest(rest.triangles, positions, query, 0.03);
    ASSERT_EQ(found.has_value(), expected.distance < 0.03) << i;
    if (!found) continue;
    ++near;
    EXPECT_NEAR(found->distance, expected.distance, 1e-12) << i;
    EXPECT_NEAR((position(moved, {found->triangle, found->weights}) - query).norm(),
                found->distance, 1e-12);
  }
  EXPECT_GT(near, 100);
}

TEST(SurfaceScan, OfTrianglesThatAreEquallyNearItTakesTheFirst) {
  const TriangleSurface cube = test::cube(2.0, 1);
  const SurfaceScan scan(cube);
  for (std::size_t v = 0; v < cube.vertices.size(); ++v) {
    const auto found =
        scan.closest(cube.triangles, in_single_precision(cube), 1.25 * cube.vertices[v], 1.0);
    ASSERT_TRUE(found);
    const auto first = std::ranges::find_if(cube.triangles, [&](const std::array<int, 3>& t) {
      return std::ranges::find(t, static_cast<int>(v)) != t.end();
    });
    EXPECT_EQ(found->triangle, static_cast<int>(first - cube.triangles.begin()));
  }
}

}  // namespace
}  // namespace viscera
