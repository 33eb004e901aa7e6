#include "kernels/points/kd_tree.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "kernels/base/random.h"

namespace viscera {
namespace {

/// Points that crowd towards one corner.
std::vector<Vec3> graded_points(int count) {
  const Random random(11, 0);
  std::vector<Vec3> points;
  for (int i = 0; i < count; ++i) {
    points.push_back(
        Vec3(random.uniform(3 * i), random.uniform(3 * i + 1), random.uniform(3 * i + 2))
            .array()
            .cube());
  }
  return points;
}

TEST(KdTree, NearestPointsMatchASortOfAllDistances) {
  const std::vector<Vec3> points = graded_points(700);
  const KdTree tree(points);
  const Random random(12, 0);
  std::vector<KdTree::Found> found;
  for (int query = 0; query < 200; ++query) {
    const Vec3 x(random.uniform(3 * query), random.uniform(3 * query + 1),
                 1.5 * random.uniform(3 * query + 2));
    std::vector<KdTree::Found> all;
    for (int i = 0; i < 700; ++i) all.push_back({(points[i] - x).squaredNorm(), i});
    std::sort(all.begin(), all.end());
    tree.nearest(x, 9, all[2].index, found);
    all.erase(all.begin() + 2);
    ASSERT_EQ(found.size(), 9u);
    for (int n = 0; n < 9; ++n) ASSERT_EQ(found[n].index, all[n].index);
    ASSERT_LE(tree.nearest_distance(x), std::sqrt(all[0].distance2));
  }
}

TEST(KdTree, CoincidentPointsAreFoundInTheOrderOfTheirIndices) {
  const std::vector<Vec3> points(50, Vec3::Ones());
  const KdTree tree(points);
  std::vector<KdTree::Found> found;
  tree.nearest(Vec3::Zero(), 3, 1, found);
  ASSERT_EQ(found.size(), 3u);
  EXPECT_EQ(found[0].index, 0);
  EXPECT_EQ(found[1].index, 2);
  EXPECT_EQ(found[2].index, 3);
}

TEST(KdTree, AskedForNoneItFindsNone) {
  const std::vector<Vec3> points(50, Vec3::Ones());
  const KdTree tree(points);
  for (const int k : {0, -1}) {
    std::vector<KdTree::Found> found(3);
    tree.nearest(Vec3::Zero(), k, -1, found);
    EXPECT_TRUE(found.empty()) << k;
  }
}

TEST(KdTree, EmptyTreeFindsNothing) {
  const KdTree tree({});
  std::vector<KdTree::Found> found;
  tree.nearest(Vec3::Zero(), 3, -1, found);
  EXPECT_TRUE(found.empty());
  EXPECT_TRUE(std::isinf(tree.nearest_distance(Vec3::Zero())));
}

}  // namespace
}  // namespace viscera
