#include "kernels/contact/surface_carriers.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "kernels/contact/same_side.h"
#include "kernels/points/node_placement.h"
#include "kernels/points/surface_tree.h"
#include "tests/support/blocks.h"
#include "tests/support/shapes.h"

namespace viscera {
namespace {

SurfacePlaces places_on(const TriangleSurface& surface, double spacing) {
  const SurfaceTree tree(surface);
  auto cloud = place_nodes(
      surface, tree, [=](const Vec3&) { return spacing; }, NodePlacement{}, no_progress());
  EXPECT_TRUE(cloud) << cloud.error().text();
  return place_on_surface(surface, ShapeFunctions(*cloud, 1.8)).value();
}

/// Greatest difference of a carried field from itself at the vertices.
double carried_error(const TriangleSurface& drawn, const SurfacePlaces& places,
                     const std::function<double(const Vec3&)>& field) {
  const std::vector<Vec3> normals = vertex_normals(drawn);
  const SparseWeights carriers = surface_carriers(drawn.vertices, normals, places);
  EXPECT_EQ(carriers.rows(), drawn.vertices.size());
  double worst = 0.0;
  for (std::size_t v = 0; v < drawn.vertices.size(); ++v) {
    double sum = 0.0;
    for (int e = carriers.row_begin[v]; e < carriers.row_begin[v + 1]; ++e) {
      const auto entry = static_cast<std::size_t>(e);
      sum += carriers.values[entry] *
             field(places.positions[static_cast<std::size_t>(carriers.nodes[entry])]);
    }
    worst = std::max(worst, std::abs(sum - field(drawn.vertices[v])));
  }
  return worst;
}

double linear(const Vec3& x) {
  return 1.0 + 30.0 * x.x() - 20.0 * x.y() + 50.0 * x.z();
}

TEST(SurfaceCarriers, CarryLinearFieldsExactlyOnFlatAndBentSurfaces) {
  const Vec3 edges(0.04, 0.04, 0.02);
  EXPECT_LT(carried_error(test::box(edges, 20), places_on(test::box(edges, 8), 4e-3), linear),
            2e-5);
  const TriangleSurface ball = test::icosphere(0.02, 4);
  EXPECT_LT(carried_error(ball, places_on(ball, 4e-3), linear), 2e-4);
}

TEST(SurfaceCarriers, CarrySmoothFieldsWithAnErrorOfSecondOrder) {
  const TriangleSurface ball = test::icosphere(0.02, 5);
  const auto wave = [](const Vec3& x) { return std::sin(150.0 * x.x()) * std::cos(120.0 * x.y()); };
  const double coarse = carried_error(ball, places_on(ball, 5e-3), wave);
  const double fine = carried_error(ball, places_on(ball, 2.5e-3), wave);
  EXPECT_LT(fine, 0.02);
  EXPECT_GT(std::log2(coarse / fine), 2.0);
}

TEST(SurfaceCarriers, TakeNothingFromTheOtherSideOfAThinWall) {
  const TriangleSurface plate = test::box(Vec3(0.06, 0.06, 0.003), 15);
  const auto top = [](const Vec3& x) { return x.z() > 0.0 ? 1.0 : 0.0; };
  const SurfacePlaces places = places_on(plate, 3e-3);
  const std::vector<Vec3> normals = vertex_normals(plate);
  const SparseWeights carriers = surface_carriers(plate.vertices, normals, places);
  for (std::size_t v = 0; v < plate.vertices.size(); ++v) {
    if (std::abs(normals[v].z()) < 0.99) continue;  // at the rim both sides are near
    for (int e = carriers.row_begin[v]; e < carriers.row_begin[v + 1]; ++e) {
      const int place = carriers.nodes[static_cast<std::size_t>(e)];
      EXPECT_TRUE(top(places.positions[static_cast<std::size_t>(place)]) == top(plate.vertices[v]));
    }
  }
}

TEST(SurfaceCarriers, TakeNothingFromAnotherPieceHoweverNear) {
  constexpr double kSpacing = 2.0, kGap = 0.02;
  const TriangleSurface cubes = test::two_cubes(10.0, kGap, 4);
  SurfacePlaces places = places_on(cubes, kSpacing);
  places.paths = std::make_shared<const TissuePaths>(cubes);
  // Beside the gap, with a normal to its own tissue as on a dent of a ragged wall: as far below it
  // as is asked the other cube is.
  ASSERT_LT(kGap, kSideDepth * kSpacing);
  std::vector<Vec3> points;
  for (const Vec3& vertex : cubes.vertices)
    if (std::abs(vertex.x()) < 1e-9) points.push_back(vertex);
  ASSERT_GT(points.size(), 8u);
  const SparseWeights carriers =
      surface_carriers(points, std::vector<Vec3>(points.size(), Vec3(-Vec3::UnitX())), places);
  ASSERT_EQ(carriers.rows(), points.size());
  for (const int place : carriers.nodes)
    EXPECT_LT(places.positions[static_cast<std::size_t>(place)].x(), 0.5 * kGap);
}

TEST(SurfaceCarriers, APointOutOfReachTakesTheNearestPlace) {
  const TriangleSurface plate = test::box(Vec3(0.03, 0.03, 0.006), 6);
  const SurfacePlaces places = places_on(plate, 3e-3);
  const SparseWeights carriers =
      surface_carriers(std::vector{Vec3(0, 0, 1.0)}, std::vector<Vec3>{Vec3::UnitZ()}, places);
  ASSERT_EQ(carriers.nodes.size(), 1u);
  EXPECT_EQ(carriers.values[0], 1.0f);
  EXPECT_GT(places.positions[static_cast<std::size_t>(carriers.nodes[0])].z(), 0.0);
}

}  // namespace
}  // namespace viscera
