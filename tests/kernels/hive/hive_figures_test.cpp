// What tools/mutate found that whole hives forgive, by figures worked out by hand.
#include <gtest/gtest.h>

#include <cmath>

#include "kernels/hive/axial_tissue.h"
#include "kernels/hive/hive.h"
#include "kernels/hive/hive_nodes.h"
#include "kernels/hive/pressed_cells.h"
#include "tests/support/shapes.h"

namespace viscera {
namespace {

TEST(HiveNames, AreThoseOfScenes) {
  EXPECT_EQ(name_of(HiveFormulation::kPaper), "paper");
  EXPECT_EQ(name_of(HiveFormulation::kSubtracted), "subtracted");
}

TEST(HiveNodes, OnAPlaneAPlaceOfTheDiscIsTheOffsetOverTheRadius) {
  const auto surface = WalkableSurface::make(test::box(Vec3(0.1, 0.1, 0.1), 10)).value();
  const HivePattern pattern(80);
  HiveNodes nodes(pattern);
  ASSERT_EQ(nodes.place(pattern, surface, surface.nearest(Vec3(0.003, 0.001, 0.05)), 0.012, 0.01),
            HiveVerdict::kSound);
  for (std::size_t i = 0; i < pattern.places().size(); ++i)
    EXPECT_LT((nodes.in_disc(nodes.positions[i]) - pattern.places()[i]).norm(), 1e-12) << i;
}

TEST(PressedCells, ACellThatWouldPullHardlyAtAllIsLetGoOfAllTheSame) {
  // The first alone bears 1; the second would have to pull by 5e-8 of that to stay behind.
  PressedCells cells(2);
  auto matrix = cells.begin(2);
  matrix(0, 0) = matrix(1, 1) = 2.0;
  matrix(1, 0) = 1.0;
  ASSERT_TRUE(cells.check());
  const std::vector<double> depths{2.0, 1.0 - 7.5e-8};
  const auto figures = cells.solve(depths);
  ASSERT_TRUE(figures.converged);
  EXPECT_EQ(figures.touching, 1);
  EXPECT_EQ(cells.forces()[1], 0.0);
  EXPECT_NEAR(cells.forces()[0], 1.0, 1e-14);
}

TEST(PressedCells, WhatIsRaisedIsPressedByWhatItWasRaisedTo) {
  // Three cells at one spot: each bears a third of d / (1 + lifted / 3).
  PressedCells cells(3);
  cells.begin(3).setConstant(1.0);
  ASSERT_TRUE(cells.check());
  const double lifted = cells.lifted();
  ASSERT_GT(lifted, 0.0);
  EXPECT_NEAR(cells.matrix()(1, 1), 1.0 + lifted, 1e-15);
  ASSERT_TRUE(cells.solve(std::vector<double>{3.0, 3.0, 3.0}).converged);
  for (const double force : cells.forces()) EXPECT_NEAR(force, 3.0 / (3.0 + lifted), 1e-9);
}

TEST(AxialGrid, HoldsAboutTheWantedNodesHalfOfItsRadiiUnderTheTool) {
  const std::vector<double> ends{0.2, 0.55, 1.0};
  // 80: eight deep by sqrt(0.75 x 80), ten wide.
  const AxialGrid grid = AxialGrid::graded(ends, 80);
  EXPECT_EQ(grid.depths.size(), 8u);
  EXPECT_EQ(grid.radii.size(), 10u);
  EXPECT_EQ(grid.radii[0], 0.0);
  for (std::size_t i = 0; i < ends.size(); ++i) EXPECT_DOUBLE_EQ(grid.radii[i + 1], ends[i]);
}

TEST(Hive, ForcesThatAreLoadedMoveTheSurfaceAsThosePressedDo) {
  const auto surface = WalkableSurface::make(test::icosphere(0.04, 4)).value();
  HiveSettings settings;
  settings.material = {5e3, 0.45};
  settings.radius = 0.016;
  settings.nodes = 80;
  const SurfaceSpot spot = surface.nearest(Vec3(0.0, 0.004, 0.04));
  auto hive = Hive::create({&surface, nullptr, nullptr}, settings, 1).value();
  ASSERT_EQ(hive.build(spot), HiveVerdict::kSound);
  ContactCell cell;
  cell.position = spot.position;
  cell.normal = spot.normal;
  cell.direction = -spot.normal;
  cell.area = 4e-6;
  ASSERT_EQ(hive.seat({&cell, 1}), HiveVerdict::kSound);
  const double depth = 1e-3;
  ASSERT_EQ(hive.press({&depth, 1}).verdict, HiveVerdict::kSound);
  const double force = hive.cell_forces()[0];
  ASSERT_GT(force, 0.0);
  const SurfaceSpot beside = surface.nearest(Vec3(0.005, 0.004, 0.04));
  const Vec3 moved = hive.displacement(beside);
  ASSERT_GT(moved.norm(), 1e-6);
  const double twice = 2.0 * force;
  hive.load({&twice, 1});
  EXPECT_LT((hive.displacement(beside) - 2.0 * moved).norm(), 1e-9 * moved.norm());
}

}  // namespace
}  // namespace viscera
