#include "kernels/points/neighbours.h"

#include <gtest/gtest.h>

#include <cmath>

#include "kernels/base/random.h"

namespace viscera {
namespace {

struct Balls {
  std::vector<Vec3> points;
  std::vector<double> radii;
};

/// Points in a flat box whose radii span `ratio`.
Balls random_balls(int count, double ratio) {
  const Random random(21, 0);
  Balls balls;
  for (int i = 0; i < count; ++i) {
    balls.points.emplace_back(random.uniform(4 * i), random.uniform(4 * i + 1),
                              0.2 * random.uniform(4 * i + 2));
    balls.radii.push_back(0.02 * std::pow(ratio, random.uniform(4 * i + 3)));
  }
  return balls;
}

void expect_as_brute_force(const Balls& balls, const std::vector<Vec3>& queries) {
  const InfluenceGrid grid(balls.points, balls.radii);
  std::vector<int> found;
  for (const Vec3& x : queries) {
    std::vector<int> expected;
    for (std::size_t i = 0; i < balls.points.size(); ++i) {
      if ((x - balls.points[i]).norm() < balls.radii[i]) expected.push_back(static_cast<int>(i));
    }
    grid.reaching(x, found);
    ASSERT_EQ(found, expected) << x.transpose();
  }
}

std::vector<Vec3> random_queries(int count) {
  const Random random(22, 0);
  std::vector<Vec3> queries;
  for (int i = 0; i < count; ++i) {
    queries.emplace_back(1.6 * random.uniform(3 * i) - 0.3, 1.6 * random.uniform(3 * i + 1) - 0.3,
                         0.8 * random.uniform(3 * i + 2) - 0.3);
  }
  return queries;
}

TEST(InfluenceGrid, FindsThePointsThatBruteForceFinds) {
  const Balls balls = random_balls(1500, 4.0);
  expect_as_brute_force(balls, random_queries(2000));
  expect_as_brute_force(balls, balls.points);
}

TEST(InfluenceGrid, CopesWithRadiiThatSpanThreeDecades) {
  Balls balls = random_balls(500, 2.0);
  balls.radii[3] = 2.0;
  balls.radii[4] = 0.002;
  expect_as_brute_force(balls, random_queries(500));
}

TEST(InfluenceGrid, CopesWithPointsThatAreFarApartAgainstTheirRadii) {
  Balls balls;
  balls.points = {Vec3::Zero(), Vec3(1e4, 1e4, 1e4), Vec3(1e4 + 0.01, 1e4, 1e4)};
  balls.radii = {0.02, 0.02, 0.02};
  expect_as_brute_force(balls, {Vec3(0.01, 0, 0), Vec3(1e4 + 0.005, 1e4, 1e4), Vec3(50, 50, 50)});
}

TEST(InfluenceGrid, PointsAtExactlyTheirRadiusAreNotReported) {
  const std::vector<Vec3> points{Vec3::Zero()};
  const std::vector<double> radii{1.0};
  const InfluenceGrid grid(points, radii);
  std::vector<int> found{5};
  grid.reaching(Vec3::UnitX(), found);
  EXPECT_TRUE(found.empty());
  grid.reaching(Vec3(0.0, 0.999, 0.0), found);
  EXPECT_EQ(found, std::vector<int>{0});
}

TEST(InfluenceGrid, EmptyGridFindsNothing) {
  const InfluenceGrid grid({}, {});
  std::vector<int> found{1};
  grid.reaching(Vec3::Zero(), found);
  EXPECT_TRUE(found.empty());
}

TEST(NearestNeighbours, AreSortedByDistanceAndExcludeThePointItself) {
  const std::vector<Vec3> points{{0, 0, 0}, {1, 0, 0}, {3, 0, 0}, {7, 0, 0}};
  EXPECT_EQ(nearest_neighbours(points, 2), (std::vector<int>{1, 2, 0, 2, 1, 0, 2, 1}));
}

TEST(NearestNeighbours, MissingOnesAreMinusOne) {
  const std::vector<Vec3> points{{0, 0, 0}, {1, 0, 0}};
  EXPECT_EQ(nearest_neighbours(points, 3), (std::vector<int>{1, -1, -1, 0, -1, -1}));
  EXPECT_TRUE(nearest_neighbours({}, 3).empty());
}

}  // namespace
}  // namespace viscera
