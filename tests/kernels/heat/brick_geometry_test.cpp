#include "kernels/heat/brick_geometry.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <numeric>

namespace viscera {
namespace {

constexpr double kVoxel = 0.5e-3;

double surface_area(const BrickGeometry& geometry) {
  double area = 0.0;
  for (const BrickGeometry::Surface& one : geometry.surface) area += one.area;
  return area * kVoxel * kVoxel;
}

double volume(const BrickGeometry& geometry) {
  return std::accumulate(geometry.fraction.begin(), geometry.fraction.end(), 0.0) * kVoxel *
         kVoxel * kVoxel;
}

TEST(BrickGeometry, DeepInsideEveryBrickIsTheSameWholeOne) {
  int asked = 0;
  const auto deep = make_geometry({1, 2, 3}, kVoxel, [&](const Vec3&) {
    ++asked;
    return -1.0;
  });
  EXPECT_EQ(deep, BrickGeometry::whole());
  EXPECT_EQ(asked, 1);
  EXPECT_EQ(make_geometry({0, 0, 0}, kVoxel, nullptr), BrickGeometry::whole());
}

TEST(BrickGeometry, NoPlaceIsAskedTwice) {
  std::vector<Vec3> asked;
  make_geometry({0, 0, 0}, kVoxel, [&](const Vec3& at) {
    asked.push_back(at);
    return at.z() - 1.6e-3;
  });
  for (std::size_t i = 0; i < asked.size(); ++i)
    for (std::size_t j = 0; j < i; ++j) ASSERT_NE(asked[i], asked[j]);
  EXPECT_LT(asked.size(), 729u);
}

TEST(BrickGeometry, FarOutsideABrickIsEmpty) {
  const auto outside = make_geometry({0, 0, 0}, kVoxel, [](const Vec3&) { return 1.0; });
  EXPECT_TRUE(outside->empty);
  EXPECT_EQ(volume(*outside), 0.0);
  EXPECT_TRUE(outside->surface.empty());
}

TEST(BrickGeometry, ALevelSurfaceHasItsAreaAndItsVolume) {
  const double height = 1.6e-3;  // a fifth of a voxel above a face
  const auto level =
      make_geometry({0, 0, 0}, kVoxel, [&](const Vec3& p) { return p.z() - height; });
  const double edge = BrickField::kEdge * kVoxel;
  EXPECT_NEAR(surface_area(*level), edge * edge, 1e-6 * edge * edge);
  EXPECT_NEAR(volume(*level), edge * edge * height, 1e-6 * edge * edge * height);
  EXPECT_EQ(level->surface.size(), 64u);
}

TEST(BrickGeometry, ATiltedPlaneHasItsArea) {
  const Vec3 normal = Vec3(0.3, -0.5, 0.9).normalized();
  const Vec3 middle = Vec3::Constant(0.5 * BrickField::kEdge * kVoxel);
  const auto tilted =
      make_geometry({0, 0, 0}, kVoxel, [&](const Vec3& p) { return normal.dot(p - middle); });
  // Steepest along z: it leaves the brick through its sides, and its area is that of its shadow.
  const double edge = BrickField::kEdge * kVoxel;
  EXPECT_NEAR(surface_area(*tilted), edge * edge / normal.z(), 1e-5 * edge * edge);
  // Slivers count as a tenth of a voxel.
  EXPECT_NEAR(volume(*tilted), 0.5 * edge * edge * edge, 4e-3 * edge * edge * edge);
}

TEST(BrickGeometry, ABallsAreaAndVolumeConvergeOverBricks) {
  const double radius = 3e-3;
  const auto ball = [&](const Vec3& p) { return p.norm() - radius; };
  double area = 0.0, filled = 0.0;
  for (int z = -1; z <= 0; ++z)
    for (int y = -1; y <= 0; ++y)
      for (int x = -1; x <= 0; ++x) {
        const auto part = make_geometry({x, y, z}, kVoxel, ball);
        area += surface_area(*part);
        filled += volume(*part);
      }
  const double exact_area = 4.0 * std::numbers::pi * radius * radius;
  EXPECT_NEAR(area, exact_area, 0.01 * exact_area);
  EXPECT_NEAR(filled, exact_area * radius / 3.0, 0.01 * exact_area * radius / 3.0);
}

TEST(BrickGeometry, NeighboursAgreeOnTheFacesThatTheyShare) {
  const auto ball = [](const Vec3& p) { return (p - Vec3(4e-3, 1e-3, 2e-3)).norm() - 1.7e-3; };
  const auto left = make_geometry({0, 0, 0}, kVoxel, ball);
  const auto right = make_geometry({1, 0, 0}, kVoxel, ball);
  constexpr int kRow = BrickGeometry::kRow, kEdge = BrickGeometry::kEdge;
  float open = 0.0f;
  for (int row = 0; row < kEdge * kEdge; ++row) {
    EXPECT_EQ(left->open_x[kRow * row + kEdge], right->open_x[kRow * row]);
    open += right->open_x[kRow * row];
  }
  EXPECT_GT(open, 10.0f);
}

TEST(BrickGeometry, NoCutVoxelIsTooThinForTheStep) {
  const auto level =
      make_geometry({0, 0, 0}, kVoxel, [](const Vec3& p) { return p.z() - 1.5001e-3; });
  for (const BrickGeometry::Surface& one : level->surface)
    EXPECT_GE(level->fraction[one.voxel], 0.1f);
}

}  // namespace
}  // namespace viscera
