#include "kernels/points/curved_refinement.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "kernels/points/surface_checks.h"
#include "tests/support/shapes.h"

namespace viscera {
namespace {

bool longer_than_4_mm(const Vec3& a, const Vec3& b, const Vec3&) {
  return (a - b).norm() > 4e-3;
}

bool bulges(const Vec3& a, const Vec3& b, const Vec3& middle) {
  return (middle - 0.5 * (a + b)).norm() > 1e-4;
}

/// The refined surface in single precision, as it is drawn.
TriangleSurface shaped(const CurvedRefinement& refinement, const TriangleSurface& coarse) {
  std::vector<Vec3f> positions, normals;
  for (const Vec3& vertex : coarse.vertices) positions.push_back(vertex.cast<float>());
  for (const Vec3& normal : vertex_normals(coarse)) normals.push_back(normal.cast<float>());
  refinement.extend(positions, normals);
  EXPECT_EQ(positions.size(), normals.size());
  for (const Vec3f& normal : normals) EXPECT_NEAR(normal.norm(), 1.0f, 1e-5f);
  TriangleSurface fine{{}, refinement.triangles()};
  for (const Vec3f& position : positions) fine.vertices.push_back(position.cast<double>());
  return fine;
}

TEST(CurvedRefinement, ACoarseBallBecomesRoundAndStaysClosed) {
  const TriangleSurface coarse = test::icosphere(0.05, 2);
  const TriangleSurface fine = shaped(CurvedRefinement(coarse, bulges), coarse);
  EXPECT_TRUE(surface_defects(fine).empty());
  const auto missing = [](const TriangleSurface& surface) {
    return 4.0 / 3.0 * 3.14159265358979 * std::pow(0.05, 3) - volume(surface);
  };
  EXPECT_GT(missing(fine), 0.0);
  EXPECT_LT(missing(fine), 0.2 * missing(coarse));
}

TEST(CurvedRefinement, WhatIsFlatOrFineEnoughIsLeftAsItIs) {
  const TriangleSurface cube = test::cube(0.04, 2);
  const CurvedRefinement of_cube(cube, bulges);
  EXPECT_FALSE(of_cube.divides_any());
  EXPECT_EQ(of_cube.triangles(), cube.triangles);
  const CurvedRefinement of_ball(test::icosphere(0.02, 5), bulges);
  EXPECT_FALSE(of_ball.divides_any());
}

TEST(CurvedRefinement, ADividedCubeStaysACube) {
  const TriangleSurface cube = test::cube(0.04, 1);
  const CurvedRefinement refinement(cube, longer_than_4_mm);
  const TriangleSurface fine = shaped(refinement, cube);
  EXPECT_TRUE(refinement.divides_any());
  EXPECT_TRUE(surface_defects(fine).empty());
  EXPECT_NEAR(volume(fine), volume(cube), 1e-6 * volume(cube));
  EXPECT_NEAR(area(fine), area(cube), 1e-6 * area(cube));
}

TEST(CurvedRefinement, ItsShapeFollowsTheCoarseSurfaceAsThatDeforms) {
  const TriangleSurface ball = test::icosphere(0.05, 2);
  const CurvedRefinement refinement(ball, bulges);
  TriangleSurface moved = ball;
  const Eigen::AngleAxisd turn(0.7, Vec3(1.0, 2.0, -1.0).normalized());
  for (Vec3& vertex : moved.vertices) vertex = 1.3 * (turn * vertex) + Vec3(0.1, -0.2, 0.05);
  const TriangleSurface fine = shaped(refinement, ball), fine_moved = shaped(refinement, moved);
  ASSERT_EQ(fine.vertices.size(), fine_moved.vertices.size());
  for (std::size_t v = 0; v < fine.vertices.size(); ++v)
    EXPECT_LT(
        (fine_moved.vertices[v] - 1.3 * (turn * fine.vertices[v]) - Vec3(0.1, -0.2, 0.05)).norm(),
        1e-6);
}

/// A strip of 2 x 0.5 in the plane z = 0, whose triangles begin at these corners.
TriangleSurface strip(int first, int second) {
  TriangleSurface surface;
  surface.vertices = {{0, 0, 0}, {2, 0, 0}, {2, 0.5, 0}, {0, 0.5, 0}};
  surface.triangles = {{0, 1, 2}, {0, 2, 3}};
  std::ranges::rotate(surface.triangles[0], surface.triangles[0].begin() + first);
  std::ranges::rotate(surface.triangles[1], surface.triangles[1].begin() + second);
  return surface;
}

TEST(CurvedRefinement, ATriangleOfWhichTwoEdgesAreDividedBecomesThreeWhicheverTheyAre) {
  const auto longer_than_1 = [](const Vec3& a, const Vec3& b, const Vec3&) {
    return (a - b).norm() > 1.1;
  };
  for (int first = 0; first < 3; ++first)
    for (int second = 0; second < 3; ++second) {
      TriangleSurface coarse = strip(first, second);
      // Wherever it lies, what is left of a triangle is divided along the shorter diagonal; the
      // other is longer than 1.1, too.
      for (Vec3& vertex : coarse.vertices) vertex -= Vec3(1.5, 0.25, 0.0);
      const CurvedRefinement refinement(coarse, longer_than_1);
      const TriangleSurface fine = shaped(refinement, coarse);
      ASSERT_EQ(fine.vertices.size(), 7u);
      ASSERT_EQ(fine.triangles.size(), 6u);
      for (int t = 0; t < 6; ++t) EXPECT_GT(area_vector(fine, t).z(), 0.05) << first << second;
      EXPECT_NEAR(area(fine), 1.0, 1e-6);
    }
}

TEST(CurvedRefinement, WhereAnEdgeBendsBothWaysTheNormalOfItsMiddleLeansTheOtherWay) {
  const TriangleSurface coarse = strip(0, 0);
  const CurvedRefinement refinement(
      coarse, [](const Vec3& a, const Vec3& b, const Vec3&) { return (a - b).norm() > 1.1; });
  // All corners lean along -x: between two of them along x the surface rises and falls again.
  std::vector<Vec3> positions = coarse.vertices, normals(4, Vec3(-0.6, 0.0, 0.8));
  refinement.extend(positions, normals);
  ASSERT_EQ(positions.size(), 7u);
  for (std::size_t i = 4; i < 7; ++i) {
    const bool along_x = positions[i].y() == 0.0 || positions[i].y() == 0.5;
    if (along_x) {
      EXPECT_LT((normals[i] - Vec3(0.6, 0.0, 0.8)).norm(), 1e-12) << i;
    }
  }
}

TEST(CurvedRefinement, AnEdgeThatCollapsesGivesNoNonFinitePlace) {
  const TriangleSurface ball = test::icosphere(0.05, 1);
  const CurvedRefinement refinement(ball, bulges);
  std::vector<Vec3f> positions(ball.vertices.size(), Vec3f::Zero()), normals;
  for (const Vec3& normal : vertex_normals(ball)) normals.push_back(normal.cast<float>());
  refinement.extend(positions, normals);
  EXPECT_TRUE(std::ranges::all_of(positions, [](const Vec3f& p) { return p.allFinite(); }));
  EXPECT_TRUE(std::ranges::all_of(normals, [](const Vec3f& n) { return n.allFinite(); }));
}

}  // namespace
}  // namespace viscera
