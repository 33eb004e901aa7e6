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

TEST(MeetingSamples, WithoutAPitchThereAreNone) {
  EXPECT_TRUE(Ball().patches(0.0).empty());
}

}  // namespace
}  // namespace viscera::test
