#include "kernels/points/marching_tetrahedra.h"

#include <gtest/gtest.h>

#include <numbers>

#include "kernels/base/random.h"
#include "kernels/points/surface_checks.h"

namespace viscera {
namespace {

using Index = MarchingTetrahedra::Index;

/// Over all cubes of a lattice of unit cells about the origin.
TriangleSurface marched(int half, const std::function<double(const Index&)>& value) {
  MarchingTetrahedra marching([](const Index& at) { return Vec3(at.cast<double>()); });
  for (int z = -half; z < half; ++z)
    for (int y = -half; y < half; ++y)
      for (int x = -half; x < half; ++x) {
        std::array<double, 8> values;
        for (int c = 0; c < 8; ++c)
          values[static_cast<std::size_t>(c)] =
              value(MarchingTetrahedra::corner(Index(x, y, z), c));
        marching.visit({x, y, z}, values);
      }
  return marching.take();
}

TEST(MarchingTetrahedra, GoAboutABallOnBothSidesOfZero) {
  const double radius = 6.3;
  const TriangleSurface ball =
      marched(8, [&](const Index& at) { return at.cast<double>().norm() - radius; });
  EXPECT_TRUE(surface_defects(ball).empty()) << surface_defects(ball).front();
  EXPECT_NEAR(volume(ball), 4.0 / 3.0 * std::numbers::pi * radius * radius * radius,
              0.03 * volume(ball));
}

TEST(MarchingTetrahedra, LeaveNoEdgeOpenWhateverTheFieldIs) {
  for (std::uint64_t seed = 0; seed < 10; ++seed) {
    const Random random(seed, 0);
    const TriangleSurface surface = marched(5, [&](const Index& at) {
      if (at.cwiseAbs().maxCoeff() == 5) return 1.0;  // nothing leaves the lattice
      const Index place = at + Index::Constant(5);
      return random.uniform(
                 static_cast<std::uint64_t>(place.x() + 11 * place.y() + 121 * place.z())) -
             0.5;
    });
    for (const std::string& defect : surface_defects(surface))
      EXPECT_TRUE(defect.starts_with("disconnected")) << defect;
  }
}

TEST(MarchingTetrahedra, OfAFieldOfOneSignIsNothing) {
  EXPECT_TRUE(marched(2, [](const Index&) { return 1.0; }).empty());
  EXPECT_TRUE(marched(2, [](const Index&) { return -1.0; }).empty());
}

}  // namespace
}  // namespace viscera
