#include "engine/render/triangle_clusters.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "tests/support/shapes.h"

namespace viscera {
namespace {

TEST(TriangleClusters, KeepEveryTriangleOnce) {
  const TriangleSurface ball = test::icosphere(0.02, 4);
  const TriangleClusters clusters(ball);
  auto sorted = clusters.triangles();
  auto expected = ball.triangles;
  std::ranges::sort(sorted);
  std::ranges::sort(expected);
  EXPECT_EQ(sorted, expected);
  std::size_t sum = 0;
  for (std::size_t i = 0; i < clusters.count(); ++i) sum += clusters.cluster(i).size();
  EXPECT_EQ(sum, ball.triangles.size());
}

TEST(TriangleClusters, BoundsHoldTheDeformedClusterAndAreFarSmallerThanTheOrgan) {
  const TriangleSurface ball = test::icosphere(0.02, 5);
  TriangleClusters clusters(ball);
  std::vector<Vec3f> positions;
  for (const Vec3& vertex : ball.vertices)
    positions.push_back((1.5 * vertex + Vec3(0.1, 0.0, 0.0)).cast<float>());
  clusters.fit(positions);
  double mean = 0.0;
  for (std::size_t i = 0; i < clusters.count(); ++i) {
    for (const auto& triangle : clusters.cluster(i))
      for (const int vertex : triangle)
        EXPECT_TRUE(clusters.bounds(i).contains(
            positions[static_cast<std::size_t>(vertex)].cast<double>()));
    mean += clusters.bounds(i).diagonal().norm() / static_cast<double>(clusters.count());
  }
  EXPECT_LT(mean, 0.5 * 2.0 * 0.03 * std::sqrt(3.0));
}

TEST(TriangleClusters, ASurfaceWithoutTrianglesHasNone) {
  EXPECT_EQ(TriangleClusters(TriangleSurface{}).count(), 0u);
}

}  // namespace
}  // namespace viscera
