#include "kernels/hive/hive_nodes.h"

#include <gtest/gtest.h>

#include "engine/verification/bodies.h"

namespace viscera {
namespace {

TEST(HiveNodes, PatternsHoldAtMostTheWantedNodes) {
  for (const int wanted : {14, 28, 57, 80, 120, 200, 512}) {
    const HivePattern pattern(wanted);
    EXPECT_LE(pattern.nodes(), wanted);
    EXPECT_GT(pattern.nodes(), wanted / 2) << wanted;
    EXPECT_EQ(pattern.places().size(), static_cast<std::size_t>(pattern.ring_nodes()));
    EXPECT_EQ(pattern.triangles().size(),
              static_cast<std::size_t>(6 * pattern.rings() * pattern.rings()));
  }
}

TEST(HiveNodes, PlacesOfTheDiscAreMeansOfTheirTriangle) {
  const HivePattern pattern(200);
  for (int i = -9; i <= 9; ++i) {
    for (int j = -9; j <= 9; ++j) {
      const Vec2 wanted(0.08 * i + 0.003, 0.08 * j - 0.002);
      if (wanted.norm() > 0.85) continue;
      const PatternPlace place = pattern.locate(wanted);
      Vec2 mean = Vec2::Zero();
      for (std::size_t a = 0; a < 3; ++a) {
        EXPECT_GE(place.weights[a], 0.0);
        mean += place.weights[a] * pattern.places()[static_cast<std::size_t>(place.nodes[a])];
      }
      EXPECT_LT((mean - wanted).norm(), 1e-12);
    }
  }
}

TEST(HiveNodes, LieOnTheSurfaceAndAlongItsInwardNormals) {
  const auto surface = WalkableSurface::make(ringed_hemisphere(0.025, 40));
  ASSERT_TRUE(surface);
  const HivePattern pattern(120);
  HiveNodes nodes(pattern);
  ASSERT_EQ(
      nodes.place(pattern, *surface, surface->nearest(Vec3(0.004, 0.002, 0.024)), 0.01, 0.008),
      HiveVerdict::kSound);
  double area = 0.0;
  for (std::size_t i = 0; i < nodes.normals.size(); ++i) {
    const double share = pattern.depths().back();
    EXPECT_NEAR(nodes.positions[i].norm(), 0.025, 1e-4);
    const Vec3& deepest = nodes.positions[nodes.positions.size() - nodes.normals.size() + i];
    EXPECT_NEAR((nodes.positions[i] - deepest).norm(), 0.008 * share, 1e-12);
    EXPECT_NEAR(deepest.norm(), 0.017, 2e-4);
    area += nodes.areas[i];
  }
  EXPECT_NEAR(area, 3.14159 * 1e-4, 0.12 * 3.14159 * 1e-4);  // a polygon, bent
  EXPECT_LT(nodes.in_disc(nodes.centre.position).norm(), 1e-12);
}

TEST(HiveNodes, AreRefusedWhereTheSurfaceTurnsBackOrEnds) {
  TriangleSurface plate = unit_cube(20);
  for (Vec3& vertex : plate.vertices) vertex = vertex.cwiseProduct(Vec3(0.04, 0.04, 0.001));
  const auto surface = WalkableSurface::make(plate);
  ASSERT_TRUE(surface);
  const HivePattern pattern(80);
  HiveNodes nodes(pattern);
  // Around the rim of a sheet to its other side.
  EXPECT_EQ(nodes.place(pattern, *surface, surface->nearest(Vec3(0.0199, 0.0, 0.0005)), 0.01, 0.01),
            HiveVerdict::kFolded);
  EXPECT_EQ(nodes.place(pattern, *surface, SurfaceSpot{}, 0.01, 0.01), HiveVerdict::kNotOnSurface);
  SurfaceSpot spot = surface->nearest(Vec3(0, 0, 0.0005));
  spot.point.weights[1] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(nodes.place(pattern, *surface, spot, 0.01, 0.01), HiveVerdict::kNotFinite);
}

}  // namespace
}  // namespace viscera
