#include "engine/collision/collision_surface.h"

#include <gtest/gtest.h>
#include <oneapi/tbb/global_control.h>
#include <oneapi/tbb/info.h>
#include <oneapi/tbb/parallel_for.h>

#include <atomic>
#include <cmath>

#include "kernels/base/random.h"
#include "kernels/points/surface_scan.h"
#include "kernels/points/surface_tree.h"
#include "tests/support/shapes.h"

namespace viscera {
namespace {

std::vector<Vec3f> positions_of(const TriangleSurface& surface) {
  std::vector<Vec3f> positions;
  for (const Vec3& v : surface.vertices) positions.push_back(v.cast<float>());
  return positions;
}

TEST(CollisionSurface, ClosestPointsAgreeWithTheTreeOfSetUp) {
  const TriangleSurface ball = test::icosphere(25e-3, 3);
  const CollisionSurface collision(ball, positions_of(ball));
  const SurfaceTree tree(ball);
  const Random random(7, 0);
  for (std::uint64_t i = 0; i < 200; ++i) {
    const Vec3 query = random.direction(i) * (10e-3 + 30e-3 * random.uniform(1000 + i));
    const auto hit = collision.closest(query, 0.1);
    ASSERT_TRUE(hit);
    const auto expected = tree.closest(query);
    EXPECT_NEAR(hit->distance, expected.distance, 1e-8);
    EXPECT_NEAR(hit->point.weights.sum(), 1.0, 1e-12);
    EXPECT_LT((position(ball, hit->point) - hit->position).norm(), 1e-8);
  }
}

TEST(CollisionSurface, AScanWithoutAHierarchyFindsTheSame) {
  TriangleSurface ball = test::icosphere(25e-3, 4);
  const SurfaceScan scan(ball);
  CollisionSurface fitted(ball, positions_of(ball));
  const Random random(8, 0);
  for (std::uint64_t i = 0; i < 200; ++i) {
    for (Vec3& vertex : ball.vertices) vertex.z() += 1e-3 * std::sin(1e3 * vertex.x() + i);
    fitted.update(positions_of(ball));
    const Vec3 query = random.direction(i) * (50e-3 * random.uniform(1000 + i));
    const double radius = i % 2 ? 0.1 : 8e-3;
    const auto found = scan.closest(ball.triangles, positions_of(ball), query, radius);
    const auto hit = fitted.closest(query, radius);
    ASSERT_EQ(found.has_value(), hit.has_value()) << i;
    if (!hit) continue;
    EXPECT_EQ(found->triangle, hit->point.triangle) << i;
    EXPECT_EQ(found->weights, hit->point.weights) << i;
    EXPECT_EQ(found->distance, hit->distance) << i;
  }
}

TEST(CollisionSurface, NothingIsFoundBeyondTheRadius) {
  const TriangleSurface ball = test::icosphere(25e-3, 2);
  const CollisionSurface collision(ball, positions_of(ball));
  EXPECT_FALSE(collision.closest(Vec3(0, 0, 40e-3), 10e-3));
  EXPECT_TRUE(collision.closest(Vec3(0, 0, 40e-3), 16e-3));
}

TEST(CollisionSurface, ARayEntersWhereTheSurfaceFacesItAndLeavesBehind) {
  const TriangleSurface cube = test::cube(20e-3, 4);
  const CollisionSurface collision(cube, positions_of(cube));
  const Vec3 origin(1e-3, 2e-3, 50e-3), down(0, 0, -1);
  const auto entry = collision.cast(origin, down, 1.0);
  const auto exit = collision.cast(origin, down, 1.0, true);
  ASSERT_TRUE(entry && exit);
  EXPECT_NEAR(entry->position.z(), 10e-3, 1e-8);
  EXPECT_NEAR(exit->position.z(), -10e-3, 1e-8);
  EXPECT_NEAR(entry->distance, 40e-3, 1e-7);
  EXPECT_FALSE(collision.cast(origin, -down, 1.0));
  EXPECT_FALSE(collision.cast(origin, down, 30e-3));
  // From inside, nothing ahead faces the ray.
  EXPECT_FALSE(collision.cast(Vec3::Zero(), down, 1.0));
}

// Embree casts in single precision, which rounds places by some 1e-9 m here.
TEST(CollisionSurface, ARayMeetsTheSurfaceWhereDoublePrecisionSays) {
  const TriangleSurface ball = test::icosphere(25e-3, 3);
  const CollisionSurface collision(ball, positions_of(ball));
  const Random random(9, 0);
  for (std::uint64_t i = 0; i < 200; ++i) {
    const Vec3 from = 60e-3 * random.direction(i);
    const Vec3 way = (10e-3 * random.direction(1000 + i) - from).normalized();
    const auto hit = collision.cast(from, way, 0.1);
    ASSERT_TRUE(hit);
    EXPECT_LT((from + hit->distance * way - hit->position).norm(), 1e-15) << i;
    EXPECT_GE(hit->point.weights.minCoeff(), 0.0);
    // Of a little more, a little more is seen.
    const Vec3 aside = 1e-12 * random.direction(2000 + i);
    const auto other = collision.cast(from + aside, way, 0.1);
    ASSERT_TRUE(other);
    EXPECT_LT((other->position - hit->position).norm(), 1e-11) << i;
  }
}

TEST(CollisionSurface, FollowsTheMovedVertices) {
  const TriangleSurface ball = test::icosphere(25e-3, 3);
  auto positions = positions_of(ball);
  CollisionSurface collision(ball, positions);
  for (Vec3f& p : positions) p += Vec3f(0.05f, 0.0f, 0.0f);
  collision.update(positions);
  const auto hit = collision.cast(Vec3(0.05, 0, 0.1), -Vec3::UnitZ(), 1.0);
  ASSERT_TRUE(hit);
  EXPECT_NEAR(hit->position.z(), 25e-3, 1e-4);
  EXPECT_FALSE(collision.cast(Vec3(0, 0, 0.1), -Vec3::UnitZ(), 1.0));
}

TEST(CollisionSurface, LeavesTheLoopsOfTheProcessAllTheirThreads) {
  using oneapi::tbb::global_control;
  const TriangleSurface ball = test::icosphere(25e-3, 2);
  const CollisionSurface collision(ball, positions_of(ball));
  EXPECT_EQ(global_control::active_value(global_control::max_allowed_parallelism),
            static_cast<std::size_t>(oneapi::tbb::info::default_concurrency()));
}

TEST(CollisionSurface, ManyThreadsMayAskWhatHasJustMoved) {
  const oneapi::tbb::global_control four(oneapi::tbb::global_control::max_allowed_parallelism, 4);
  const TriangleSurface ball = test::icosphere(25e-3, 4);
  auto positions = positions_of(ball);
  CollisionSurface collision(ball, positions);
  for (int round = 0; round < 20; ++round) {
    for (Vec3f& p : positions) p += Vec3f(1e-3f, 0.0f, 0.0f);
    collision.update(positions);
    const Vec3 above(1e-3 * (round + 1), 0.0, 0.1);
    std::atomic<int> right = 0;
    oneapi::tbb::parallel_for(0, 64, [&](int) {
      const auto hit = collision.cast(above, -Vec3::UnitZ(), 1.0);
      if (hit && std::abs(hit->position.z() - 25e-3) < 1e-4) ++right;
    });
    EXPECT_EQ(right, 64);
  }
}

}  // namespace
}  // namespace viscera
