#include "engine/verification/smoke_case.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>

namespace viscera {
namespace {

TEST(SmokeCase, IsFilledAsTheMidstOfAPlume) {
  const SmokeCase smoke(8000);
  SmokeVolume volume(smoke.parameters());
  smoke.fill(volume);
  ASSERT_EQ(volume.particles().size(), 8000u);
  EXPECT_EQ(volume.counters().refused, 0u);
  // Eight particles a cube of the support radius, but for the room that the sheet's bumps leave.
  const Vec3 size = smoke.parameters().domain.sizes();
  const double h = smoke.parameters().spacing;
  const double filled = size.x() * size.y() * size.x();
  EXPECT_NEAR(8000.0 / (filled / (h * h * h)), 8.0, 1e-6);
}

TEST(SmokeCase, StepsWithoutSubstepsAndKeepsItsParticles) {
  SmokeCase smoke(4000);
  SmokeVolume volume(smoke.parameters());
  smoke.fill(volume);
  for (int s = 0; s < 20; ++s) {
    volume.step(1.0 / 60.0, smoke.around(s / 60.0));
    float fastest = 0.0f;
    for (const Float4& v : volume.particles().velocities)
      fastest = std::max(fastest, v.xyz().norm());
    EXPECT_LT(fastest / 60.0f, 0.5f * static_cast<float>(smoke.parameters().spacing)) << s;
  }
  EXPECT_GT(volume.particles().size(), 3900u);
  EXPECT_GT(volume.counters().tested, 100u);
}

TEST(SmokeCase, SheetHasTrianglesOfAnOrgansSize) {
  const SmokeCase smoke(100'000);
  double sum = 0.0;
  int edges = 0;
  for (const auto& t : smoke.sheet().triangles) {
    const auto corner = [&](int i) {
      return smoke.sheet().vertices[static_cast<std::size_t>(t[i])];
    };
    const Vec3 normal = (corner(1) - corner(0)).cross(corner(2) - corner(0));
    if (normal.z() < 1e-9) continue;  // of the sides or the bottom
    for (int e = 0; e < 3; ++e, ++edges) sum += (corner(e) - corner((e + 1) % 3)).norm();
  }
  EXPECT_NEAR(sum / edges, 4.6e-3, 0.5e-3);  // squares of 4 mm with a diagonal
}

}  // namespace
}  // namespace viscera
