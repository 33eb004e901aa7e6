#include "engine/features/touching/meeting_samples.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "engine/verification/bodies.h"

namespace viscera::test {
namespace {

constexpr double kRadius = 25e-3;

TriangleSurface ball() {
  std::vector<Vec2> outline;
  constexpr int kSteps = 60;
  for (int i = 0; i <= kSteps; ++i) {
    const double angle = std::numbers::pi * i / kSteps;
    const double across = i == 0 || i == kSteps ? 0.0 : kRadius * std::sin(angle);
    outline.emplace_back(across, kRadius * std::cos(angle));
  }
  return turned_surface(outline);
}

struct Ball {
  TriangleSurface surface = ball();
  std::vector<Vec3f> positions, normals;
  Ball() {
    for (const Vec3& x : surface.vertices) positions.push_back(x.cast<float>());
    for (const Vec3& n : vertex_normals(surface)) normals.push_back(n.cast<float>());
  }
  std::vector<SurfacePatch> patches(double pitch) const {
    const CollisionSurface finder(surface, positions);
    return patches_of(surface, normals, finder, [=](const Vec3&) { return pitch; });
  }
};

TEST(MeetingSamples, PatchesShareTheWholeSurfaceOutAmongThem) {
  const Ball body;
  for (const double pitch : {1e-3, 3e-3, 8e-3}) {
    const auto patches = body.patches(pitch);
    double sum = 0.0;
    for (const SurfacePatch& patch : patches) sum += patch.area;
    EXPECT_NEAR(sum, area(body.surface), 1e-9 * sum) << pitch;
    for (std::size_t i = 0; i < patches.size(); i += 7)
      for (std::size_t j = 0; j < i; ++j)
        ASSERT_GE((patches[i].position - patches[j].position).norm(), pitch);
  }
}

TEST(MeetingSamples, APatchOnABallLiesBelowItsMiddleByItsCurvature) {
  const Ball body;
  for (const SurfacePatch& patch : body.patches(5e-3)) {
    EXPECT_LT((patch.normal - patch.position.normalized()).norm(), 0.05);
    // rho^2 / (4 R) of a disc, where triangles of 1.3 mm may err by 8 um.
    EXPECT_NEAR(patch.height, -patch.area / (4.0 * std::numbers::pi * kRadius), 0.02e-3);
    EXPECT_LT(patch.mean().norm(), patch.position.norm());
  }
}

/// A block of 30 x 30 x 15 mm, triangles 5 mm wide: its vertices' normals lean out at its edges.
TriangleSurface block() {
  const Vec3 size(30e-3, 30e-3, 15e-3);
  TriangleSurface surface;
  for (int axis = 0; axis < 3; ++axis)
    for (const double side : {-0.5, 0.5}) {
      const int u = (axis + 1) % 3, v = (axis + 2) % 3;
      const int across = static_cast<int>(std::lround(size[u] / 5e-3)),
                along = static_cast<int>(std::lround(size[v] / 5e-3));
      const auto first = static_cast<int>(surface.vertices.size());
      for (int j = 0; j <= along; ++j)
        for (int i = 0; i <= across; ++i) {
          Vec3 x;
          x[axis] = side * size[axis];
          x[u] = (static_cast<double>(i) / across - 0.5) * size[u];
          x[v] = (static_cast<double>(j) / along - 0.5) * size[v];
          surface.vertices.push_back(x);
        }
      for (int j = 0; j < along; ++j)
        for (int i = 0; i < across; ++i) {
          const int a = first + j * (across + 1) + i, b = a + 1, c = a + across + 1, d = c + 1;
          if (side > 0.0) {
            surface.triangles.push_back({a, b, d});
            surface.triangles.push_back({a, d, c});
          } else {
            surface.triangles.push_back({a, d, b});
            surface.triangles.push_back({a, c, d});
          }
        }
    }
  return surface;
}

TEST(MeetingSamples, NoPatchGoesAroundAnEdge) {
  const TriangleSurface surface = block();
  std::vector<Vec3f> positions, normals;
  for (const Vec3& x : surface.vertices) {
    positions.push_back(x.cast<float>());
    // As where faces share their vertices.
    normals.push_back(
        x.cwiseQuotient(Vec3(15e-3, 15e-3, 7.5e-3))
            .unaryExpr([](double share) { return std::abs(share) > 0.99 ? share : 0.0; })
            .normalized()
            .cast<float>());
  }
  const CollisionSurface finder(surface, positions);
  const auto patches = patches_of(surface, normals, finder, [](const Vec3&) { return 3e-3; });
  double on_top = 0.0;
  for (const SurfacePatch& patch : patches) {
    EXPECT_GT(patch.normal.cwiseAbs().maxCoeff(), 0.94) << patch.position.transpose();
    EXPECT_LT(std::abs(patch.height), 1e-8) << patch.position.transpose();
    if (patch.normal.z() > 0.5) on_top += patch.area;
  }
  EXPECT_NEAR(on_top, 900e-6, 1e-9);
}

TEST(MeetingSamples, WithoutAPitchThereAreNone) {
  EXPECT_TRUE(Ball().patches(0.0).empty());
}

}  // namespace
}  // namespace viscera::test
