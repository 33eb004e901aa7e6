#include "kernels/smoke/solid_cells.h"

#include <gtest/gtest.h>

#include <numeric>
#include <vector>

#include "kernels/points/surface.h"
#include "tests/support/shapes.h"

namespace viscera {
namespace {

std::vector<Vec3f> places_of(const TriangleSurface& surface) {
  std::vector<Vec3f> places;
  for (const Vec3& vertex : surface.vertices) places.push_back(vertex.cast<float>());
  return places;
}

/// Cells of 1 mm about the origin.
SolidGrid millimetres(int cells) {
  return {Vec3::Constant(-0.5e-3 * cells), Vec3::Constant(1e-3), {cells, cells, cells}};
}

std::vector<std::uint8_t> marked(const TriangleSurface& surface, const Pose& pose,
                                 const SolidGrid& grid) {
  std::vector<std::uint8_t> solid(grid.size(), 0);
  mark_solid(places_of(surface), surface.triangles, pose, grid, solid);
  return solid;
}

Vec3 middle(const SolidGrid& grid, std::size_t cell) {
  const auto n = static_cast<std::size_t>(grid.cells[0]);
  const Vec3 index(static_cast<double>(cell % n), static_cast<double>(cell / n % n),
                   static_cast<double>(cell / n / n));
  return grid.origin + (index.array() + 0.5).matrix().cwiseProduct(grid.spacing);
}

TEST(SolidCells, AreThoseWhoseMiddlesLieInsideATurnedAndMovedBall) {
  const TriangleSurface ball = test::icosphere(9.3e-3, 4);
  const Pose pose{Vec3(1.1e-3, -2.3e-3, 0.7e-3),
                  Quaternion(Eigen::AngleAxisd(0.7, Vec3(1, 2, 3).normalized()))};
  const SolidGrid grid = millimetres(30);
  const std::vector<std::uint8_t> solid = marked(ball, pose, grid);
  for (std::size_t cell = 0; cell < grid.size(); ++cell) {
    const double out = (middle(grid, cell) - pose.position).norm() - 9.3e-3;
    if (std::abs(out) > 0.06e-3) {
      EXPECT_EQ(solid[cell], out < 0.0) << cell;
    }
  }
}

TEST(SolidCells, EdgesAndCornersOverMiddlesNeitherLeakNorCountTwice) {
  // Corners, edges and diagonals of all faces lie over middles of cells, to the last bit.
  constexpr double kCell = 0x1p-10;
  const TriangleSurface cube = test::cube(8 * kCell, 8);
  const SolidGrid grid{Vec3::Constant(-10.5 * kCell), Vec3::Constant(kCell), {21, 21, 21}};
  const std::vector<std::uint8_t> solid = marked(cube, {}, grid);
  std::size_t inside = 0;
  for (std::size_t cell = 0; cell < grid.size(); ++cell) {
    const Vec3 at = middle(grid, cell).cwiseAbs();
    if (at.maxCoeff() < 3.9 * kCell) {
      EXPECT_EQ(solid[cell], 1) << middle(grid, cell).transpose();
    }
    if (at.maxCoeff() > 4.1 * kCell) {
      EXPECT_EQ(solid[cell], 0) << middle(grid, cell).transpose();
    }
    inside += solid[cell];
  }
  // Of the faces at x and y each column belongs to one side.
  EXPECT_EQ(inside, 8u * 8u * 9u);
}

TEST(SolidCells, AHollowBodyIsSolidInItsWallAlone) {
  TriangleSurface shell = test::icosphere(12e-3, 3);
  const TriangleSurface hollow = test::icosphere(6e-3, 3);
  const int first = static_cast<int>(shell.vertices.size());
  shell.vertices.insert(shell.vertices.end(), hollow.vertices.begin(), hollow.vertices.end());
  for (const std::array<int, 3>& t : hollow.triangles)
    shell.triangles.push_back({first + t[0], first + t[2], first + t[1]});
  const SolidGrid grid = millimetres(30);
  const std::vector<std::uint8_t> solid = marked(shell, {}, grid);
  for (std::size_t cell = 0; cell < grid.size(); ++cell) {
    const double r = middle(grid, cell).norm();
    if (r < 5.5e-3 || r > 12.1e-3) {
      EXPECT_EQ(solid[cell], 0) << r;
    }
    if (r > 6.1e-3 && r < 11.5e-3) {
      EXPECT_EQ(solid[cell], 1) << r;
    }
  }
}

TEST(SolidCells, WhatReachesBeyondTheGridIsCutOffThere) {
  const TriangleSurface ball = test::icosphere(20e-3, 3);
  const SolidGrid grid = millimetres(10);
  const std::vector<std::uint8_t> solid = marked(ball, {}, grid);
  EXPECT_EQ(std::accumulate(solid.begin(), solid.end(), 0u), grid.size());
  const Pose beside{Vec3(0.1, 0, 0), Quaternion::Identity()};
  const std::vector<std::uint8_t> none = marked(ball, beside, grid);
  EXPECT_EQ(std::accumulate(none.begin(), none.end(), 0u), 0u);
}

TEST(SolidCells, ThoseOfSeveralBodiesAddUp) {
  const SolidGrid grid = millimetres(30);
  const TriangleSurface ball = test::icosphere(4e-3, 3);
  std::vector<std::uint8_t> both(grid.size(), 0);
  const Pose left{Vec3(-6e-3, 0, 0), Quaternion::Identity()};
  const Pose right{Vec3(6e-3, 0, 0), Quaternion::Identity()};
  mark_solid(places_of(ball), ball.triangles, left, grid, both);
  mark_solid(places_of(ball), ball.triangles, right, grid, both);
  const auto one = marked(ball, left, grid), other = marked(ball, right, grid);
  for (std::size_t cell = 0; cell < grid.size(); ++cell)
    EXPECT_EQ(both[cell], one[cell] | other[cell]);
}

TEST(SolidCells, AnOpenSurfaceMarksNoEndlessColumns) {
  TriangleSurface open = test::icosphere(9e-3, 3);
  open.triangles.resize(open.triangles.size() / 2);
  const SolidGrid grid = millimetres(30);
  const std::vector<std::uint8_t> solid = marked(open, {}, grid);
  for (std::size_t cell = 0; cell < grid.size(); ++cell)
    if (solid[cell]) {
      EXPECT_LT(middle(grid, cell).norm(), 9.1e-3);
    }
}

}  // namespace
}  // namespace viscera
