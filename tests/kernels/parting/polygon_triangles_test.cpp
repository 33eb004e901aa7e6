#include "kernels/parting/polygon_triangles.h"

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <numbers>

namespace viscera {
namespace {

/// Areas add up, none is turned over, and each side but those of the loops belongs to two.
void expect_filled(const std::vector<Vec2>& places, const std::vector<PolygonLoop>& loops) {
  const std::vector<std::array<int, 3>> triangles = polygon_triangles(places, loops);
  double sum = 0.0, area = 0.0;
  std::size_t corners = 0;
  std::map<std::pair<int, int>, int> sides;
  for (const auto& triangle : triangles) {
    const double doubled = doubled_area(places, {triangle[0], triangle[1], triangle[2]});
    EXPECT_GT(doubled, 0.0);
    sum += doubled;
    for (std::size_t i = 0; i < 3; ++i) ++sides[{triangle[i], triangle[(i + 1) % 3]}];
  }
  for (const PolygonLoop& loop : loops) {
    area += doubled_area(places, loop);
    corners += loop.size();
    for (std::size_t i = 0; i < loop.size(); ++i)
      EXPECT_EQ((sides[{loop[i], loop[(i + 1) % loop.size()]}]), 1);
  }
  EXPECT_NEAR(sum, area, 1e-12 * std::abs(area));
  EXPECT_EQ(triangles.size(), corners - 2 + 2 * (loops.size() - 1));
  for (const auto& [side, count] : sides) EXPECT_EQ(count, 1) << side.first << " " << side.second;
}

std::vector<Vec2> ring(int count, double radius, double wave) {
  std::vector<Vec2> places;
  for (int i = 0; i < count; ++i) {
    const double angle = 2.0 * std::numbers::pi * i / count;
    const double r = radius * (1.0 + wave * std::sin(5.0 * angle));
    places.push_back({r * std::cos(angle), r * std::sin(angle)});
  }
  return places;
}

TEST(PolygonTriangles, FillAPolygonThatIsNotConvex) {
  const std::vector<Vec2> places = ring(40, 1.0, 0.6);
  PolygonLoop loop;
  for (int i = 0; i < 40; ++i) loop.push_back(i);
  expect_filled(places, {loop});
}

TEST(PolygonTriangles, LeaveHolesOpen) {
  std::vector<Vec2> places = {{-3, -3}, {3, -3}, {3, 3}, {-3, 3}};
  PolygonLoop outer = {0, 1, 2, 3};
  std::vector<PolygonLoop> loops = {outer};
  for (const double x : {-1.5, 1.4}) {
    PolygonLoop hole;
    for (const Vec2& place : ring(9, 0.8, 0.2)) {
      hole.push_back(static_cast<int>(places.size()));
      places.push_back(place + Vec2(x, 0.1 * x));
    }
    std::reverse(hole.begin(), hole.end());
    loops.push_back(hole);
  }
  expect_filled(places, loops);
}

TEST(PolygonTriangles, UseCornersOnStraightSides) {
  const std::vector<Vec2> places = {{0, 0}, {1, 0}, {2, 0}, {3, 0}, {2, 1}, {1, 2}, {0, 3}, {0, 1}};
  expect_filled(places, {{0, 1, 2, 3, 4, 5, 6, 7}});
  // Two lines side by side, as a flat cut leaves them.
  std::vector<Vec2> strip;
  PolygonLoop around;
  for (int i = 0; i < 30; ++i) strip.push_back({0.1 * i + 0.03 * (i % 3), 0.0});
  for (int i = 30; i-- > 0;) strip.push_back({0.1 * i, 0.4});
  for (int i = 0; i < 60; ++i) around.push_back(i);
  expect_filled(strip, {around});
}

TEST(PolygonTriangles, KnowWhatLiesWithin) {
  const std::vector<Vec2> places = {{0, 0}, {2, 0}, {2, 2}, {1, 0.5}, {0, 2}};
  const PolygonLoop loop = {0, 1, 2, 3, 4};
  EXPECT_TRUE(lies_within(places, loop, {0.2, 0.2}));
  EXPECT_FALSE(lies_within(places, loop, {1.0, 1.5}));
  EXPECT_FALSE(lies_within(places, loop, {3.0, 0.2}));
}

}  // namespace
}  // namespace viscera
