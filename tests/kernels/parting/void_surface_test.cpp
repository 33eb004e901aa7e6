#include "kernels/parting/void_surface.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "kernels/base/random.h"
#include "kernels/parting/blade_sweep.h"
#include "kernels/points/surface_checks.h"

namespace viscera {
namespace {

constexpr double kVoidVoxel = 0.5e-3;

TEST(VoidSurface, IsNoneWhereNothingIsGone) {
  EXPECT_TRUE(void_surface(TissueShare(kVoidVoxel)).empty());
}

TEST(VoidSurface, OfABallIsItsSphere) {
  TissueShare tissue(kVoidVoxel);
  const double radius = 4e-3;
  tissue.take_out(Box(Vec3::Constant(-radius), Vec3::Constant(radius)),
                  [&](const Vec3& x) { return x.norm() - radius; });
  const TriangleSurface surface = void_surface(tissue);
  EXPECT_TRUE(surface_defects(surface).empty()) << surface_defects(surface).front();
  for (const Vec3& x : surface.vertices) EXPECT_NEAR(x.norm(), radius, 0.1 * kVoidVoxel);
  EXPECT_NEAR(area(surface), 4.0 * std::numbers::pi * radius * radius, 0.02 * area(surface));
  const double ball = 4.0 / 3.0 * std::numbers::pi * radius * radius * radius;
  EXPECT_NEAR(volume(surface), ball, 0.015 * ball);
}

TEST(VoidSurface, OfABladesWayIsFlatWhereTheBladeWent) {
  TissueShare tissue(kVoidVoxel);
  const Vec3 across = Vec3(1.0, 2.0, -0.7).normalized(), down = across.unitOrthogonal(),
             along = across.cross(down);
  sweep({{Vec3(-8e-3 * along), Vec3(8e-3 * along)},
         {Vec3(-8e-3 * along + 6e-3 * down), Vec3(8e-3 * along + 6e-3 * down)},
         0.0},
        tissue);
  const TriangleSurface surface = void_surface(tissue);
  EXPECT_TRUE(surface_defects(surface).empty()) << surface_defects(surface).front();
  int walls = 0;
  for (const Vec3& x : surface.vertices) {
    if (std::abs(x.dot(along)) > 7e-3 || x.dot(down) < 1e-3 || x.dot(down) > 5e-3) continue;
    EXPECT_NEAR(std::abs(x.dot(across)), 0.5 * tissue.least_kerf(), 0.1 * kVoidVoxel);
    ++walls;
  }
  EXPECT_GT(walls, 500);
}

TEST(VoidSurface, IsClosedWhateverTheSharesAre) {
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    const Random random(seed, 0);
    TissueShare tissue(kVoidVoxel);
    for (std::uint64_t k = 0; k < 400; ++k)
      tissue.limit({static_cast<int>(20 * random.uniform(4 * k)),
                    static_cast<int>(12 * random.uniform(4 * k + 1)) - 6,
                    static_cast<int>(8 * random.uniform(4 * k + 2))},
                   random.uniform(4 * k + 3));
    // Of several pieces, and hollow ones; nothing else.
    for (const std::string& defect : surface_defects(void_surface(tissue)))
      EXPECT_EQ(defect.substr(0, 12), "disconnected") << defect;
  }
}

}  // namespace
}  // namespace viscera
