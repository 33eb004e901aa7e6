#include "kernels/parting/carve.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "kernels/base/random.h"
#include "kernels/parting/blade_sweep.h"
#include "kernels/parting/void_surface.h"
#include "kernels/points/closed_pieces.h"
#include "kernels/points/surface_checks.h"
#include "kernels/points/surface_tree.h"
#include "tests/support/blocks.h"
#include "tests/support/shapes.h"

namespace viscera {
namespace {

constexpr double kVoxel = 0.5e-3;
const Vec3 kSize(30e-3, 20e-3, 10e-3);  // of the block [m]

TriangleSurface block() {
  return bricks(lines(-0.5 * kSize.x(), 0.5 * kSize.x(), 2.5e-3),
                lines(-0.5 * kSize.y(), 0.5 * kSize.y(), 2.5e-3),
                lines(-0.5 * kSize.z(), 0.5 * kSize.z(), 2.5e-3), [](const Vec3&) { return true; });
}

TissueShare without_ball(const Vec3& centre, double radius) {
  TissueShare tissue(kVoxel);
  const Vec3 half = Vec3::Constant(radius);
  tissue.take_out(Box(centre - half, centre + half),
                  [&](const Vec3& x) { return (x - centre).norm() - radius; });
  return tissue;
}

/// Closed, manifold, oriented outwards; of any number of pieces.
void expect_sound(const TriangleSurface& surface) {
  for (const std::string& defect : surface_defects(surface))
    EXPECT_EQ(defect.substr(0, 12), "disconnected") << defect;
}

/// A place lies in what is left where it lies in the body and not in what is gone.
void expect_difference(const TriangleSurface& body, const TriangleSurface& gone,
                       const TriangleSurface& left, std::uint64_t seed) {
  const SurfaceTree in_body(body), in_gone(gone), in_left(left);
  const Box box = bounds(body);
  const Random random(seed, 7);
  int asked = 0;
  for (std::uint64_t k = 0; k < 400; ++k) {
    const Vec3 share(random.uniform(3 * k), random.uniform(3 * k + 1), random.uniform(3 * k + 2));
    const Vec3 place = box.min() + 1.02 * share.cwiseProduct(box.sizes());
    const double a = in_body.signed_distance(place), b = in_gone.signed_distance(place);
    if (std::min(std::abs(a), std::abs(b)) < 1e-6) continue;
    EXPECT_EQ(in_left.signed_distance(place) < 0.0, a < 0.0 && b > 0.0) << place.transpose();
    ++asked;
  }
  EXPECT_GT(asked, 300);
}

TEST(Carve, LeavesABodyAsItIsWhereNothingOfItIsGone) {
  const TriangleSurface body = block();
  const auto left = carve(body, void_surface(without_ball(Vec3(0, 0, 30e-3), 4e-3)));
  ASSERT_TRUE(left) << left.error().text();
  EXPECT_EQ(left->surface.vertices, body.vertices);
  EXPECT_EQ(left->surface.triangles, body.triangles);
}

TEST(Carve, LeavesNothingOfWhatIsGoneAltogether) {
  const auto left = carve(block(), void_surface(without_ball(Vec3::Zero(), 22e-3)));
  ASSERT_TRUE(left) << left.error().text();
  EXPECT_TRUE(left->surface.empty());
}

TEST(Carve, OpensAHollowWithin) {
  const TriangleSurface body = block();
  const TriangleSurface gone = void_surface(without_ball(Vec3::Zero(), 3e-3));
  const auto left = carve(body, gone);
  ASSERT_TRUE(left) << left.error().text();
  expect_sound(left->surface);
  EXPECT_NEAR(volume(left->surface), volume(body) - volume(gone), 1e-9 * volume(body));
}

TEST(Carve, TakesHalfABallFromASide) {
  const TriangleSurface body = block();
  const double radius = 4e-3;
  const TriangleSurface gone =
      void_surface(without_ball(Vec3(1e-3, 2e-3, 0.5 * kSize.z()), radius));
  const auto left = carve(body, gone);
  ASSERT_TRUE(left) << left.error().text();
  expect_sound(left->surface);
  const double half_ball = 2.0 / 3.0 * std::numbers::pi * radius * radius * radius;
  EXPECT_NEAR(volume(left->surface), volume(body) - half_ball, 0.02 * half_ball);
  // Its wall is the half sphere's, and the body's own triangles are all skin.
  double wall = 0.0;
  for (std::size_t t = 0; t < left->skin.size(); ++t)
    if (left->skin[t] < 0) wall += area_vector(left->surface, static_cast<int>(t)).norm();
  EXPECT_NEAR(wall, 2.0 * std::numbers::pi * radius * radius, 0.02 * wall);
  expect_difference(body, gone, left->surface, 1);
}

TEST(Carve, KeepsVerticesAndTrianglesAwayFromTheCut) {
  const TriangleSurface body = block();
  const auto left = carve(body, void_surface(without_ball(Vec3(0, 0, 0.5 * kSize.z()), 3e-3)));
  ASSERT_TRUE(left) << left.error().text();
  std::vector<int> where(body.vertices.size(), -1);
  for (std::size_t v = 0; v < left->vertices.size(); ++v) {
    if (left->vertices[v] < 0) continue;
    const auto own = static_cast<std::size_t>(left->vertices[v]);
    EXPECT_EQ(left->surface.vertices[v], body.vertices[own]);
    where[own] = static_cast<int>(v);
  }
  std::size_t kept = 0;
  for (std::size_t t = 0; t < left->skin.size(); ++t) {
    if (left->skin[t] < 0) continue;
    const auto& own = body.triangles[static_cast<std::size_t>(left->skin[t])];
    kept += left->surface.triangles[t] == std::array{where[static_cast<std::size_t>(own[0])],
                                                     where[static_cast<std::size_t>(own[1])],
                                                     where[static_cast<std::size_t>(own[2])]};
    // Skin stays in the plane of the triangle that it was.
    const Vec3 before = area_vector(body, left->skin[t]).normalized();
    EXPECT_GT(area_vector(left->surface, static_cast<int>(t)).dot(before), 0.0);
  }
  EXPECT_GT(kept, body.triangles.size() - 40);
}

TEST(Carve, ABladesWayThroughLeavesTwoPieces) {
  TissueShare tissue(kVoxel);
  sweep({{Vec3(1e-3, -30e-3, 9e-3), Vec3(2e-3, 30e-3, 9e-3)},
         {Vec3(3e-3, -30e-3, -9e-3), Vec3(4e-3, 30e-3, -9e-3)},
         0.0},
        tissue);
  const TriangleSurface body = block(), gone = void_surface(tissue);
  const auto left = carve(body, gone);
  ASSERT_TRUE(left) << left.error().text();
  expect_sound(left->surface);
  EXPECT_EQ(closed_pieces(left->surface).size(), 2u);
  expect_difference(body, gone, left->surface, 2);
}

TEST(Carve, CutsOfAnySortLeaveClosedBodies) {
  const std::array<TriangleSurface, 2> bodies = {block(), test::icosphere(12e-3, 3)};
  for (std::uint64_t seed = 0; seed < 24; ++seed) {
    const Random random(seed, 0);
    const TriangleSurface& body = bodies[seed % 2];
    TissueShare tissue(kVoxel);
    std::uint64_t drawn = 0;
    const auto place = [&] {
      const Vec3 share(random.uniform(drawn), random.uniform(drawn + 1), random.uniform(drawn + 2));
      drawn += 3;
      return Vec3(34e-3 * (share - Vec3::Constant(0.5)));
    };
    // Some cross, some end inside.
    for (std::uint64_t cut = 0; cut <= seed % 3; ++cut) {
      const Vec3 a = place(), b = place(), way = 0.5 * place();
      sweep({{a, b}, {Vec3(a + way), Vec3(b + way)}, 0.0}, tissue);
    }
    const TriangleSurface gone = void_surface(tissue);
    const auto left = carve(body, gone);
    ASSERT_TRUE(left) << seed << ": " << left.error().text();
    SCOPED_TRACE(seed);
    expect_sound(left->surface);
    expect_difference(body, gone, left->surface, seed);
  }
}

}  // namespace
}  // namespace viscera
