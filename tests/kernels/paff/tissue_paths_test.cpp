#include "kernels/paff/tissue_paths.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "kernels/base/random.h"
#include "tests/support/blocks.h"
#include "tests/support/shapes.h"

namespace viscera {
namespace {

constexpr double kGap = 0.6;

/// 40 x 10 x 4 each, on a root of 4; the gap about z = 0.
TissuePaths leaves() {
  return TissuePaths(test::leaves({40.0, 10.0, 4.0}, kGap, 4.0, 2.0));
}

bool has_walls_beyond_air(const TissuePaths& paths, const Vec3& from, double length) {
  return paths.any_wall_beyond_air(from, length, [](const Vec3&) { return true; });
}

TEST(TissuePaths, LeaveTheBodyAcrossAGapAndStayInItWithinALeafAndThroughTheRoot) {
  const TissuePaths paths = leaves();
  EXPECT_FALSE(paths.straight({20, 0, 1}, {20.3, 0.2, -1}));
  EXPECT_TRUE(paths.straight({20, 0, 1}, {25, 3, 4}));
  EXPECT_TRUE(paths.straight({-1, 0, 1}, {-2, 1, -1}));
}

TEST(TissuePaths, MayBeginAndEndOnTheWalls) {
  const TissuePaths paths = leaves();
  const Vec3 upper(20, 0, 0.5 * kGap), lower(20, 0, -0.5 * kGap);
  EXPECT_FALSE(paths.straight(upper, lower));
  EXPECT_FALSE(paths.straight(upper, {20, 0, -2}));
  EXPECT_FALSE(paths.straight({20, 0, 2}, lower));
  EXPECT_TRUE(paths.straight(upper, {23, 1, 0.5 * kGap}));  // along the wall
  EXPECT_TRUE(paths.straight(upper, {20, 0, 3}));
  EXPECT_TRUE(paths.straight({20, 0, 3}, upper));
}

TEST(TissuePaths, DoNotSlipOverAGapAlongFlatSides) {
  // In the planes of the sides and the ends, through edges of triangles and their corners.
  const TissuePaths paths = leaves();
  EXPECT_FALSE(paths.straight({20, -5, 1}, {21, -5, -1}));
  EXPECT_FALSE(paths.straight({40, 1, 1}, {40, 1.5, -1}));
  EXPECT_FALSE(paths.straight({20, -5, 0.5 * kGap}, {20, -5, -0.5 * kGap}));
  EXPECT_FALSE(paths.straight({40, -5, 2}, {40, -5, -2}));
  const Vec3 way = Vec3(3e-16, 7e-17, 0);
  EXPECT_FALSE(paths.straight(Vec3(20, -5, 1) + way, Vec3(21, -5, -1) - way));
}

TEST(TissuePaths, OfAConvexBodyNeverMeetAir) {
  const Random random(3, 0);
  const TissuePaths box(test::cube(1.0, 4)), ball(test::icosphere(0.5, 3));
  for (std::uint64_t i = 0; i < 500; ++i) {
    const auto place = [&](std::uint64_t k) -> Vec3 {
      const std::uint64_t at = 6 * i + 3 * k;
      return Vec3(random.uniform(at), random.uniform(at + 1), random.uniform(at + 2)) -
             Vec3::Constant(0.5);
    };
    Vec3 from = place(0), to = place(1);
    from[static_cast<Eigen::Index>(i % 3)] = 0.5;  // on a face
    EXPECT_TRUE(box.straight(from, to));
    EXPECT_TRUE(box.straight(to, from));
    EXPECT_FALSE(has_walls_beyond_air(box, from, 0.7));
    EXPECT_FALSE(has_walls_beyond_air(ball, 0.45 * from.normalized(), 0.4));
  }
}

TEST(TissuePaths, PassOverAGentleHollowButNotOverACrease) {
  // A block whose upper side is a hollow of radius 10.
  const auto around = lines(-4.0, 4.0, 0.5);
  TriangleSurface hollow =
      bricks(around, around, lines(-6.0, 0.0, 1.0), [](const Vec3&) { return true; });
  for (Vec3& v : hollow.vertices)
    if (v.z() > -1e-9) v.z() = 10.0 - std::sqrt(100.0 - v.x() * v.x());
  const TissuePaths gentle(hollow);
  const Vec3 left(-2.0, 0.0, 10.0 - std::sqrt(96.0)), right(2.0, 0.0, 10.0 - std::sqrt(96.0));
  EXPECT_FALSE(gentle.straight(left, right));
  EXPECT_TRUE(gentle.nearly_straight(left, right));
  EXPECT_FALSE(has_walls_beyond_air(gentle, left, 3.0));

  // A step: the crease between its faces bends by 90 degrees.
  const auto across = lines(0.0, 4.0, 1.0);
  const TissuePaths step(
      bricks(across, across, across, [](const Vec3& x) { return x.x() < 2.0 || x.z() < 2.0; }));
  EXPECT_FALSE(step.nearly_straight({2, 2, 3}, {3, 2, 2}));
  EXPECT_TRUE(has_walls_beyond_air(step, {2, 2, 3}, 2.0));
}

TEST(TissueBends, LeadAroundTheEndOfAGapByTheShortestWay) {
  const TissuePaths paths = leaves();
  const double h = 2.0;
  const TissueBends bends(
      paths, [](const Vec3&) { return true; }, [&](const Vec3&) { return h; });
  ASSERT_GT(bends.size(), 0u);
  // Over both edges of the gap's floor, which lie in x = 0 at z = -+ half the gap.
  for (const double along : {0.2, 1.0, 2.0}) {
    const Vec3 from(along, 0.3, 1.0), to(along, -0.4, -1.0);
    double shortest = std::numeric_limits<double>::infinity();
    for (const TissuePaths::Bend& bend : bends.reached(from, 8.0))
      if (paths.straight(bend.position, to))
        shortest = std::min(shortest, bend.length + (to - bend.position).norm());
    // Unrolled into a plane.
    const double leg = std::hypot(along, 1.0 - 0.5 * kGap);
    const double expected = std::hypot(2.0 * leg + kGap, 0.7);
    EXPECT_GT(shortest, expected - 1e-9) << along;
    EXPECT_LT(shortest, 1.03 * expected) << along;
  }
}

/// Both walls of a gap, and its floor, have a step of .25 here and there.
TissuePaths ragged_leaves() {
  const Random random(9, 0);
  const auto step = [&](double x, double y, int side) {
    const auto at = static_cast<std::uint64_t>(std::lround(100.0 + 4.0 * x) * 1000 +
                                               std::lround(100.0 + 4.0 * y) * 2 + side);
    return random.uniform(at) < 0.5 ? 0.25 : 0.0;
  };
  return TissuePaths(bricks(lines(-4.0, 6.0, 0.25), lines(-3.0, 3.0, 0.25), lines(-4.0, 4.0, 0.25),
                            [&](const Vec3& x) {
                              if (x.x() < -step(0.0, x.y(), 0)) return true;
                              return std::abs(x.z()) > 0.25 + step(x.x(), x.y(), x.z() > 0.0);
                            }));
}

TEST(TissueBends, OfARaggedGapLieInTheTissueAndLeadAroundIt) {
  const TissuePaths paths = ragged_leaves();
  const double h = 2.0;
  const TissueBends bends(
      paths, [](const Vec3&) { return true; }, [&](const Vec3&) { return h; });
  for (const double along : {0.5, 1.0, 2.0}) {
    const Vec3 from(along, 0.3, 1.0), to(along, -0.4, -1.0);
    double shortest = std::numeric_limits<double>::infinity();
    for (const TissuePaths::Bend& bend : bends.reached(from, 8.0)) {
      EXPECT_LT(paths.tree().signed_distance(bend.position), 0.0);
      if (paths.straight(bend.position, to))
        shortest = std::min(shortest, bend.length + (to - bend.position).norm());
    }
    // Between the ways around a smooth gap with no step and one with all.
    const double none = std::hypot(2.0 * std::hypot(along, 0.75) + 0.5, 0.7);
    const double all = std::hypot(2.0 * std::hypot(along + 0.25, 0.5) + 1.0, 0.7);
    EXPECT_GT(shortest, none - 1e-9) << along;
    EXPECT_LT(shortest, 1.05 * all) << along;
  }
}

TEST(TissueBends, LeadAsFarWhateverWasAskedOfThemBefore) {
  const TissuePaths paths = ragged_leaves();
  const auto all = [](const Vec3&) { return true; };
  const auto detail = [](const Vec3&) { return 2.0; };
  const TissueBends often(paths, all, detail);
  for (const Vec3& from : {Vec3(1.0, 0.3, 1.0), Vec3(0.5, -1.0, -1.2), Vec3(2.0, 0.4, 1.1)}) {
    const auto found = often.reached(from, 6.0);
    const auto fresh = TissueBends(paths, all, detail).reached(from, 6.0);
    ASSERT_EQ(found.size(), fresh.size());
    EXPECT_GT(found.size(), 10u);
    for (std::size_t b = 0; b < found.size(); ++b) {
      EXPECT_EQ(found[b].number, fresh[b].number);
      EXPECT_EQ(found[b].length, fresh[b].length);
    }
  }
}

TEST(TissueBends, FindNoWayBetweenSeparatePieces) {
  const TissuePaths paths(test::two_cubes(10.0, 1.0, 4));
  const TissueBends bends(
      paths, [](const Vec3&) { return true; }, [](const Vec3&) { return 2.0; });
  EXPECT_EQ(bends.size(), 0u);
}

}  // namespace
}  // namespace viscera
