#include "engine/verification/bodies.h"

#include <gtest/gtest.h>

#include <numbers>

#include "kernels/points/surface_checks.h"

namespace viscera {
namespace {

TEST(VerificationBodies, CubeIsClosedAndOfUnitVolume) {
  const TriangleSurface cube = unit_cube(3);
  EXPECT_EQ(cube.triangles.size(), 6u * 9u * 2u);
  EXPECT_EQ(cube.vertices.size(), 64u - 8u);  // no vertex twice, none inside
  EXPECT_NEAR(volume(cube), 1.0, 1e-14);
}

TEST(VerificationBodies, JitterMovesInnerNodesAloneAndKeepsFacesFlat) {
  const NodedBody even = jittered_cube(4, 0.0), body = jittered_cube(4, 0.3);
  ASSERT_EQ(body.cloud.size(), 125u);
  EXPECT_EQ(body.cloud.surface_count, 125u - 27u);
  for (std::size_t i = 0; i < body.cloud.size(); ++i) {
    const Vec3 shift = body.cloud.positions[i] - even.cloud.positions[i];
    EXPECT_LE(shift.cwiseAbs().maxCoeff(), 0.3 / 4 + 1e-15);
    for (int axis = 0; axis < 3; ++axis) {
      if (std::abs(even.cloud.positions[i][axis]) == 0.5) {
        EXPECT_EQ(shift[axis], 0.0);
      }
    }
  }
  EXPECT_NE(body.cloud.positions.back(), even.cloud.positions.back());
}

TEST(VerificationBodies, HemisphereFillsTheBallFromInside) {
  const double exact = 2.0 * std::numbers::pi / 3.0;
  const double coarse = exact - volume(ringed_hemisphere(1.0, 8));
  const double fine = exact - volume(ringed_hemisphere(1.0, 16));
  EXPECT_GT(fine, 0.0);
  // Chords miss the sphere by the square of their length.
  EXPECT_NEAR(coarse / fine, 4.0, 0.2);
}

}  // namespace
}  // namespace viscera
