#include "kernels/contact/surface_places.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>

#include "kernels/points/kd_tree.h"
#include "kernels/points/node_placement.h"
#include "kernels/points/surface_tree.h"
#include "tests/support/shapes.h"

namespace viscera {
namespace {

ShapeFunctions fields_in(const TriangleSurface& surface, double spacing) {
  const SurfaceTree tree(surface);
  auto cloud = place_nodes(
      surface, tree, [=](const Vec3&) { return spacing; }, NodePlacement{}, no_progress());
  EXPECT_TRUE(cloud) << cloud.error().text();
  return ShapeFunctions(*cloud, 1.8);
}

double total_area(const SurfacePlaces& places) {
  return std::accumulate(places.areas.begin(), places.areas.end(), 0.0);
}

TEST(SurfacePlaces, DivideTheWholeAreaAmongAboutAsManyPlacesAsSurfaceNodes) {
  const TriangleSurface ball = test::icosphere(0.02, 5);  // edges of about 0.75 mm
  const ShapeFunctions fields = fields_in(ball, 4e-3);
  const auto places = place_on_surface(ball, fields);
  ASSERT_TRUE(places) << places.error().text();
  EXPECT_NEAR(total_area(*places), area(ball), 1e-12);
  EXPECT_NEAR(static_cast<double>(places->size()),
              static_cast<double>(fields.cloud().surface_count),
              0.02 * static_cast<double>(fields.cloud().surface_count));
  for (std::size_t p = 0; p < places->size(); ++p) {
    double sum = 0.0;
    for (int e = places->fields.row_begin[p]; e < places->fields.row_begin[p + 1]; ++e) {
      sum += places->fields.values[static_cast<std::size_t>(e)];
    }
    EXPECT_NEAR(sum, 1.0, 1e-5);
    EXPECT_NEAR(places->spacings[p], 4e-3, 0.4 * 4e-3);
  }
}

TEST(SurfacePlaces, LieOnABentSurfaceAndFaceOutwards) {
  const TriangleSurface ball = test::icosphere(0.02, 5);
  const auto places = place_on_surface(ball, fields_in(ball, 5e-3));
  ASSERT_TRUE(places);
  // The mean of a patch 5 mm wide is 0.15 mm under the surface; the facets are within 4 um of it.
  for (std::size_t p = 0; p < places->size(); ++p) {
    EXPECT_NEAR(places->positions[p].norm(), 0.02, 15e-6);
    EXPECT_GT(places->normals[p].dot(places->positions[p].normalized()), 0.98);
  }
}

TEST(SurfacePlaces, AreTheSameOnCoarseTrianglesAsOnFineOnes) {
  const Vec3 edges(0.06, 0.06, 0.006);
  const ShapeFunctions fields = fields_in(test::box(edges, 12), 3e-3);
  const auto coarse = place_on_surface(test::box(edges, 2), fields);
  const auto fine = place_on_surface(test::box(edges, 30), fields);
  ASSERT_TRUE(coarse && fine);
  // A sliver of a patch at an edge may be missed by coarse pieces.
  EXPECT_NEAR(static_cast<double>(coarse->size()), static_cast<double>(fine->size()), 5.0);
  const KdTree tree(fine->positions);
  for (std::size_t p = 0; p < coarse->size(); ++p) {
    if (coarse->areas[p] > 0.2 * 3e-3 * 3e-3) {
      EXPECT_LT(tree.nearest_distance(coarse->positions[p]), 0.2 * 3e-3);
    }
  }
}

TEST(SurfacePlaces, NeverMixTheFacesOfAnEdgeNorTheSidesOfAThinWall) {
  const Vec3 edges(0.06, 0.06, 0.004);
  const TriangleSurface plate = test::box(edges, 12);
  const auto places = place_on_surface(plate, fields_in(plate, 4e-3));
  ASSERT_TRUE(places);
  for (std::size_t p = 0; p < places->size(); ++p) {
    EXPECT_NEAR(places->normals[p].cwiseAbs().maxCoeff(), 1.0, 1e-12);
    int axis = 0;
    places->normals[p].cwiseAbs().maxCoeff(&axis);
    EXPECT_NEAR(std::abs(places->positions[p][axis]), 0.5 * edges[axis], 1e-12);
  }
}

TEST(SurfacePlaces, SurfaceBeyondTheCloudIsRefusedWithThePlace) {
  TriangleSurface plate = test::box(Vec3(0.06, 0.06, 0.006), 12);
  const ShapeFunctions fields = fields_in(plate, 3e-3);
  for (Vec3& vertex : plate.vertices) vertex.x() += 1.0;
  const auto places = place_on_surface(plate, fields);
  ASSERT_FALSE(places);
  EXPECT_NE(places.error().text().find("mm"), std::string::npos);
}

}  // namespace
}  // namespace viscera
