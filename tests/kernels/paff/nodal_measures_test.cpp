#include "kernels/paff/nodal_measures.h"

#include <gtest/gtest.h>

#include <numeric>

#include "tests/kernels/paff/elastic_bodies.h"

namespace viscera {
namespace {

TEST(SurfacePatches, AreasAddUpToTheSurface) {
  const test::Body body =
      test::placed_body(test::icosphere(0.05, 3), [](const Vec3&) { return 0.012; });
  const SurfacePatches patches(body.surface, body.cloud);
  double sum = 0.0;
  for (std::size_t i = 0; i < body.cloud.surface_count; ++i) sum += patches.area(i);
  EXPECT_NEAR(sum, area(body.surface), 1e-12 * sum);
}

TEST(SurfacePatches, NodesOfALatticeHaveTheCellsAboutThem) {
  constexpr int kCells = 4;
  const test::Body body = test::jittered_cube(kCells, 0.0);
  const SurfacePatches patches(body.surface, body.cloud);
  for (std::size_t i = 0; i < body.cloud.surface_count; ++i) {
    // On how many faces the node lies: 1 inside a face, 2 on an edge, 3 at a corner.
    int faces = 0;
    Vec3 normals = Vec3::Zero();
    for (int a = 0; a < 3; ++a) {
      if (std::abs(body.cloud.positions[i][a]) < 0.5 - 1e-9) continue;
      ++faces;
      normals[a] = body.cloud.positions[i][a] > 0.0 ? 1.0 : -1.0;
    }
    const double cell = 1.0 / (kCells * kCells);
    EXPECT_NEAR(patches.area(i), cell * (faces == 3 ? 0.75 : 1.0), 0.15 * cell);
    EXPECT_LT((patches.mean_normal(i) - normals / faces).norm(), 0.05);
    const Vec3 pushed = patches.mean(i, [](const Vec3& n) { return Vec3(-2.0 * n); });
    EXPECT_LT((pushed + 2.0 * patches.mean_normal(i)).norm(), 1e-14);
  }
}

TEST(NodalVolumes, AddUpToTheBodyAndItsFirstMoment) {
  test::Body body = test::jittered_cube(5, 0.2);
  for (Vec3& x : body.surface.vertices) x += Vec3(1.0, 2.0, 3.0);
  for (Vec3& x : body.cloud.positions) x += Vec3(1.0, 2.0, 3.0);
  const auto volumes = nodal_volumes(body.surface, body.cloud);
  ASSERT_TRUE(volumes) << volumes.error().text();
  Vec3 moment = Vec3::Zero();
  for (std::size_t i = 0; i < volumes->size(); ++i) {
    moment += (*volumes)[i] * body.cloud.positions[i];
  }
  EXPECT_NEAR(std::accumulate(volumes->begin(), volumes->end(), 0.0), 1.0, 1e-10);
  EXPECT_LT((moment - Vec3(1.0, 2.0, 3.0)).norm(), 1e-9);
}

}  // namespace
}  // namespace viscera
