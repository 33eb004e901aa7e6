#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "engine/organ/shape.h"
#include "tests/engine/organ/shape_check.h"
#include "tests/support/paths.h"

namespace viscera::test {
namespace {

constexpr double kPi = std::numbers::pi;

RecipeGeometry body(const std::string& name, double edge, std::optional<int> triangles = {}) {
  RecipeGeometry geometry;
  geometry.recipe = name;
  geometry.radius = 0.05;
  geometry.size = Vec3(0.1, 0.06, 0.04);
  geometry.edge = edge;
  geometry.triangles = triangles;
  return geometry;
}

TriangleSurface sound(const RecipeGeometry& geometry) {
  const TriangleSurface surface = built(geometry);
  EXPECT_EQ(defects(surface), "");
  EXPECT_GT(least_angle_degrees(surface), 20.0);
  if (geometry.triangles) {
    EXPECT_EQ(surface.triangles.size(), static_cast<std::size_t>(*geometry.triangles));
  }
  return surface;
}

TEST(BuiltInShape, SphereHasItsVerticesOnTheSphere) {
  for (const auto& geometry : {body("sphere", 5e-3), body("sphere", 0.0), body("sphere", 0, 1364),
                               body("sphere", 0, 20)}) {
    const TriangleSurface sphere = sound(geometry);
    for (const Vec3& x : sphere.vertices) EXPECT_NEAR(x.norm(), 0.05, 1e-12);
  }
}

TEST(BuiltInShape, HemisphereHasAFlatBaseADomeAndASharpRim) {
  for (const auto& geometry :
       {body("hemisphere", 5e-3), body("hemisphere", 0, 1000), body("hemisphere", 9e-3)}) {
    const TriangleSurface hemisphere = sound(geometry);
    int rim = 0;
    for (const Vec3& x : hemisphere.vertices) {
      const bool base = std::abs(x.z()) < 1e-12, dome = std::abs(x.norm() - 0.05) < 1e-9;
      EXPECT_TRUE(base || dome) << x.transpose();
      EXPECT_GE(x.z(), 0.0);
      rim += base && dome;
    }
    // The rim is a polygon of edges of about the wanted length.
    const double edge = mean_edge(hemisphere);
    EXPECT_NEAR(rim, 2.0 * kPi * 0.05 / edge, 0.15 * 2.0 * kPi * 0.05 / edge);
    const double whole = 2.0 / 3.0 * kPi * std::pow(0.05, 3);
    EXPECT_NEAR(volume(hemisphere) / whole, 1.0, std::pow(edge / 0.05, 2));
  }
}

TEST(BuiltInShape, BlockIsExact) {
  for (const auto& geometry : {body("block", 7e-3), body("block", 0.0), body("block", 0, 1000),
                               body("block", 0, 22), body("block", 1.0)}) {
    const TriangleSurface block = sound(geometry);
    EXPECT_NEAR(volume(block), 0.1 * 0.06 * 0.04, 1e-15);
    EXPECT_NEAR(area(block), 2.0 * (0.1 * 0.06 + 0.06 * 0.04 + 0.04 * 0.1), 1e-14);
    EXPECT_TRUE(bounds(block).center().isZero(1e-12));
  }
}

TEST(BuiltInShape, AbsurdSizesAndNumbersAreRefused) {
  const auto refusal = [](const RecipeGeometry& geometry) {
    const auto surface = build_shape(geometry, project_file("assets"));
    return surface ? std::string() : surface.error().text();
  };
  EXPECT_NE(refusal(body("sphere", 0, 1081)).find("even number"), std::string::npos);
  EXPECT_NE(refusal(body("sphere", 0, 10)).find("at least 20"), std::string::npos);
  EXPECT_NE(refusal(body("sphere", 1e-6)).find("expected a greater edge"), std::string::npos);
  RecipeGeometry nothing = body("sphere", 0);
  nothing.radius = 0.0;
  EXPECT_NE(refusal(nothing).find("radius"), std::string::npos);
  RecipeGeometry flat = body("block", 0);
  flat.size.z() = 0.0;
  EXPECT_NE(refusal(flat).find("size"), std::string::npos);
  RecipeGeometry huge = body("sphere", 0);
  huge.radius = 3.0;
  EXPECT_NE(refusal(huge).find("6 m across, expected 1 mm to 2 m"), std::string::npos)
      << refusal(huge);
}

}  // namespace
}  // namespace viscera::test
