#include "kernels/parting/simplify.h"

#include <gtest/gtest.h>

#include <cmath>

#include "kernels/parting/blade_sweep.h"
#include "kernels/parting/void_surface.h"
#include "kernels/points/surface_checks.h"
#include "kernels/points/surface_tree.h"
#include "tests/support/shapes.h"

namespace viscera {
namespace {

void expect_near(const TriangleSurface& few, const TriangleSurface& many, double tolerance) {
  const SurfaceTree tree(many);
  for (const Vec3& x : few.vertices) EXPECT_LT(tree.closest(x).distance, tolerance);
  const SurfaceTree back(few);
  for (const Vec3& x : many.vertices) EXPECT_LT(back.closest(x).distance, tolerance);
}

TEST(Simplify, KeepsASphereWithinItsTolerance) {
  const TriangleSurface many = test::icosphere(10e-3, 5);
  for (const double tolerance : {0.02e-3, 0.1e-3}) {
    const TriangleSurface few = simplified(many, {tolerance, 8e-3});
    EXPECT_TRUE(surface_defects(few).empty()) << surface_defects(few).front();
    EXPECT_LT(few.triangles.size(), many.triangles.size() / 4);
    expect_near(few, many, 4.0 * tolerance);
    EXPECT_NEAR(volume(few), volume(many), 0.02 * volume(many));
  }
}

TEST(Simplify, LeavesFewTrianglesOfABladesWay) {
  TissueShare tissue(0.25e-3);
  sweep({{Vec3(-8e-3, 1e-3, 0), Vec3(8e-3, 0, 0)},
         {Vec3(-8e-3, 0, -6e-3), Vec3(8e-3, 1e-3, -7e-3)},
         0.5e-3},
        tissue);
  const TriangleSurface many = void_surface(tissue);
  const TriangleSurface few = simplified(many, {0.025e-3, 4e-3});
  EXPECT_TRUE(surface_defects(few).empty()) << surface_defects(few).front();
  EXPECT_LT(few.triangles.size(), many.triangles.size() / 20);
  expect_near(few, many, 0.1e-3);
}

TEST(Simplify, MakesNoSideLongerThanWanted) {
  const double longest = 3e-3;
  const TriangleSurface few = simplified(test::icosphere(10e-3, 4), {1.0, longest});
  EXPECT_TRUE(surface_defects(few).empty()) << surface_defects(few).front();
  for (const auto& triangle : few.triangles)
    for (std::size_t i = 0; i < 3; ++i)
      EXPECT_LE((few.vertices[static_cast<std::size_t>(triangle[i])] -
                 few.vertices[static_cast<std::size_t>(triangle[(i + 1) % 3])])
                    .norm(),
                longest);
}

TEST(Simplify, LeavesWhatHasNoTriangleTooMany) {
  TriangleSurface tetrahedron;
  tetrahedron.vertices = {Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(0, 1, 0), Vec3(0, 0, 1)};
  tetrahedron.triangles = {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {0, 3, 2}};
  EXPECT_EQ(simplified(tetrahedron, {10.0, 10.0}).triangles.size(), 4u);
  EXPECT_TRUE(simplified({}, {1.0, 1.0}).empty());
}

}  // namespace
}  // namespace viscera
