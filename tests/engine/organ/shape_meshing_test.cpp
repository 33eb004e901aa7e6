#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "engine/organ/implicit_shapes.h"
#include "engine/organ/shape.h"
#include "tests/engine/organ/shape_check.h"
#include "tests/support/shapes.h"

namespace viscera::test {
namespace {

const Box kBox(Vec3::Constant(-0.06), Vec3::Constant(0.06));

SignedDistance ball(double radius) {
  return ellipsoid(Vec3::Zero(), Vec3::Constant(radius));
}

TEST(ShapeMeshing, BallHasItsVolumeGoodTrianglesAndVerticesOnItsSurface) {
  for (const double edge : {10e-3, 5e-3, 2.5e-3}) {
    const auto surface = mesh_signed_distance(ball(0.05), kBox, edge);
    ASSERT_TRUE(surface) << surface.error().text();
    EXPECT_EQ(defects(*surface), "");
    EXPECT_GT(least_angle_degrees(*surface), 25.0);
    EXPECT_LT(greatest_offset(*surface, ball(0.05)), 1e-3 * edge);
    // A triangulation with edge e lies under the sphere by about e^2 / (8 r).
    const double whole = 4.0 / 3.0 * std::numbers::pi * std::pow(0.05, 3);
    EXPECT_NEAR(volume(*surface) / whole, 1.0, 0.6 * std::pow(edge / 0.05, 2));
    EXPECT_NEAR(mean_edge(*surface), edge, 0.1 * edge);
  }
}

TEST(ShapeMeshing, FieldsWithAWrongSlopeAreMeshedWhole) {
  const auto steep = [](const Vec3& x) { return 40.0 * (x.norm() - 0.05); };
  const auto surface = mesh_signed_distance(steep, kBox, 5e-3);
  ASSERT_TRUE(surface) << surface.error().text();
  EXPECT_EQ(defects(*surface), "");
}

TEST(ShapeMeshing, TorusKeepsItsHole) {
  const auto torus = [](const Vec3& x) {
    return std::hypot(std::hypot(x.x(), x.y()) - 0.035, x.z()) - 0.015;
  };
  const auto surface = mesh_signed_distance(torus, kBox, 3e-3);
  ASSERT_TRUE(surface) << surface.error().text();
  EXPECT_EQ(defects(*surface), "");
  const auto euler = static_cast<long>(surface->vertices.size()) -
                     static_cast<long>(surface->triangles.size()) / 2;
  EXPECT_EQ(euler, 0);
}

TEST(ShapeMeshing, CrumbsAreDroppedAndRealPiecesRefused) {
  const SignedDistance crumb = join(ball(0.04), ellipsoid({0.05, 0, 0}, Vec3::Constant(4e-3)), 0.0);
  const auto surface = mesh_signed_distance(crumb, kBox, 3e-3);
  ASSERT_TRUE(surface) << surface.error().text();
  EXPECT_EQ(defects(*surface), "");
  const SignedDistance piece =
      join(ball(0.03), ellipsoid({0.045, 0, 0}, Vec3::Constant(0.01)), 0.0);
  const auto refused = mesh_signed_distance(piece, kBox, 3e-3);
  ASSERT_FALSE(refused);
  EXPECT_NE(refused.error().text().find("a second piece of 3."), std::string::npos)
      << refused.error().text();
}

TEST(ShapeMeshing, RefusesEdgesThatMakeNoSense) {
  for (const double edge : {0.0, -1e-3, std::nan(""), 1.0, 1e-6}) {
    EXPECT_FALSE(mesh_signed_distance(ball(0.05), kBox, edge)) << edge;
  }
  EXPECT_FALSE(mesh_signed_distance(ball(0.05), Box(), 3e-3));
  const auto nothing = [](const Vec3&) { return std::nan(""); };
  EXPECT_FALSE(mesh_signed_distance(nothing, kBox, 5e-3));
}

TEST(ShapeMeshing, TriangleCountIsExactFinerAndCoarser) {
  const SignedDistance body = join(ball(0.03), ellipsoid({0.03, 0, 0}, {0.02, 0.012, 0.012}), 0.01);
  const auto surface = mesh_signed_distance(body, kBox, 4e-3);
  ASSERT_TRUE(surface) << surface.error().text();
  for (const int count : {60, 500, 1080, 1364, 6002}) {
    const auto exact = with_triangle_count(*surface, count, body);
    ASSERT_TRUE(exact) << count << ": " << exact.error().text();
    EXPECT_EQ(exact->triangles.size(), static_cast<std::size_t>(count));
    EXPECT_EQ(defects(*exact), "");
    EXPECT_GT(least_angle_degrees(*exact), 15.0) << count;
    EXPECT_LT(greatest_offset(*exact, body), 1e-3 * mean_edge(*exact)) << count;
  }
  EXPECT_FALSE(with_triangle_count(*surface, 1081, body));
  EXPECT_FALSE(with_triangle_count(*surface, 18, body));
}

TEST(ShapeMeshing, RefinementRoundsACoarseBallAndKeepsItClosed) {
  const TriangleSurface coarse = icosphere(0.05, 2);  // 320 triangles
  const TriangleSurface fine = refined(coarse, 4e-3);
  EXPECT_EQ(defects(fine), "");
  double coarse_error = 0.0, fine_error = 0.0, longest = 0.0;
  const auto middle_error = [](const TriangleSurface& surface) {
    double greatest = 0.0;
    for (const auto& [a, b, c] : surface.triangles) {
      const Vec3 x = (surface.vertices[a] + surface.vertices[b] + surface.vertices[c]) / 3.0;
      greatest = std::max(greatest, std::abs(x.norm() - 0.05));
    }
    return greatest;
  };
  coarse_error = middle_error(coarse);
  fine_error = middle_error(fine);
  EXPECT_LT(fine_error, 0.12 * coarse_error);
  for (const auto& t : fine.triangles) {
    for (int i = 0; i < 3; ++i) {
      longest = std::max(longest, (fine.vertices[t[i]] - fine.vertices[t[(i + 1) % 3]]).norm());
    }
  }
  EXPECT_LE(longest, 4e-3);
}

TEST(ShapeMeshing, RefinementKeepsCubesCubic) {
  const TriangleSurface coarse = cube(0.04, 1);
  const TriangleSurface fine = refined(coarse, 5e-3);
  EXPECT_EQ(defects(fine), "");
  EXPECT_NEAR(volume(fine), volume(coarse), 1e-12);
  EXPECT_NEAR(area(fine), area(coarse), 1e-12);
}

}  // namespace
}  // namespace viscera::test
