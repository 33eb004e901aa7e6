#include "kernels/points/repulsion.h"

#include <gtest/gtest.h>

#include "tests/support/shapes.h"

namespace viscera {
namespace {

/// Nodes in the middle of a large cube, pushed once; h = 1 cm everywhere.
std::vector<Vec3> pushed(const std::vector<Vec3>& positions, double depth = 0.3) {
  const TriangleSurface cube = test::cube(1.0, 1);
  const SurfaceTree tree(cube);
  const SpacingField spacing = [](const Vec3&) { return 0.01; };
  NodePlacement options;
  options.sweeps = 1;
  const PlacementTask task{cube, tree, spacing, options, 10.0};
  PlacedNodes nodes;
  nodes.positions = positions;
  nodes.wanted.assign(positions.size(), 0.01);
  nodes.depths.assign(positions.size(), depth);  // at most
  EXPECT_TRUE(relax_all(task, nodes, no_progress()));
  return nodes.positions;
}

TEST(Repulsion, TwoNodesPushEachOtherApartAlongTheLineBetweenThem) {
  const Vec3 middle(0.1, -0.05, 0.02), along = Vec3(1.0, 2.0, -2.0) / 3.0;
  // 6 mm apart is 0.4 of the range of 1.5 h: each goes 0.15 x 0.6^2 / 0.4 of h.
  const auto after = pushed({middle + 3e-3 * along, middle - 3e-3 * along});
  EXPECT_LT((after[0] - (middle + 4.35e-3 * along)).norm(), 1e-12);
  EXPECT_LT((after[1] - (middle - 4.35e-3 * along)).norm(), 1e-12);
}

TEST(Repulsion, NoStepIsLongerThanASeventhOfTheSpacingAndNoneIsMadeBeyondTheRange) {
  const Vec3 middle(0.1, -0.05, 0.02);
  // 1 mm apart: 0.15 h each.
  EXPECT_NEAR(pushed({middle, middle + 1e-3 * Vec3::UnitX()})[1].x(), 0.101 + 1.5e-3, 1e-12);
  EXPECT_EQ(pushed({middle, middle + 15.1e-3 * Vec3::UnitX()})[0], middle);
}

TEST(Repulsion, ANodeThatIsPushedTowardsTheSurfaceStopsHalfASpacingBelowIt) {
  // 6 mm below the top, pushed up by 1.5 mm; half a spacing is 5 mm.
  const Vec3 node(0.1, -0.05, 0.494);
  const auto after = pushed({node, node - 3e-3 * Vec3::UnitZ()}, 6e-3);
  EXPECT_LT((after[0] - Vec3(0.1, -0.05, 0.5 - 1.01 * 5e-3)).norm(), 1e-12);
}

TEST(Repulsion, OfNodesTooNearEachOtherTheLaterGoes) {
  PlacedNodes nodes;
  const Vec3 place(0.3, 0.1, -0.2);
  nodes.positions = {place, -place, place + Vec3(6e-3, 0.0, 0.0), place + Vec3(0.0, 4e-3, 0.0)};
  nodes.wanted.assign(4, 0.01);
  nodes.depths.assign(4, 0.1);
  nodes.surface_count = 3;
  separate(0.5, nodes);
  ASSERT_EQ(nodes.positions.size(), 3u);
  EXPECT_EQ(nodes.positions[2], place + Vec3(6e-3, 0.0, 0.0));
  EXPECT_EQ(nodes.surface_count, 3u);
}

}  // namespace
}  // namespace viscera
