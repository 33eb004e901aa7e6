#include "kernels/hive/interior_field.h"

#include <gtest/gtest.h>

#include "kernels/contact/half_space.h"

namespace viscera {
namespace {

constexpr IsotropicMaterial kTissue{10e3, 0.42};
const Vec3 kInward = Vec3(0.2, -0.3, -1.0).normalized();

TEST(InteriorField, IsTheHalfSpacesSurfaceAtItsSurface) {
  const InteriorField field(kTissue);
  const HalfSpace surface(kTissue);
  const Vec3 along = kInward.unitOrthogonal();
  for (const double r : {0.001, 0.02}) {
    const Mat3 expected = surface.response({1.0 / r, 1.0 / r, 1.0 / r}, r * along, -kInward);
    EXPECT_LT((field.displacement(r * along, kInward) - expected).norm(), 1e-12 * expected.norm());
  }
}

TEST(InteriorField, GradientIsTheSlopeOfTheDisplacement) {
  const InteriorField field(kTissue);
  const Vec3 x = 0.004 * kInward + 0.003 * kInward.unitOrthogonal() + Vec3(1e-3, 2e-3, 0);
  const auto gradient = field.gradient(x, kInward);
  for (int d = 0; d < 3; ++d) {
    const Vec3 step = 1e-7 * Vec3::Unit(d);
    const Mat3 slope =
        (field.displacement(x + step, kInward) - field.displacement(x - step, kInward)) / 2e-7;
    EXPECT_LT((slope - gradient[static_cast<std::size_t>(d)]).norm(), 1e-6 * slope.norm());
  }
}

TEST(InteriorField, LeavesTheSurfaceFreeAndCarriesTheForceBelow) {
  const InteriorField field(kTissue);
  const Vec3 u = kInward.unitOrthogonal(), v = kInward.cross(u);
  EXPECT_LT(field.traction(0.01 * u, kInward, -kInward).norm(),
            1e-9 * field.traction(0.01 * u, kInward, u).norm());
  // Over a half-ball about the load the tractions add up to the force.
  Mat3 sum = Mat3::Zero();
  constexpr int kPolar = 200, kAround = 64;
  for (int i = 0; i < kPolar; ++i) {
    const double height = (i + 0.5) / kPolar, across = std::sqrt(1.0 - height * height);
    for (int k = 0; k < kAround; ++k) {
      const double angle = 2.0 * 3.14159265358979 * k / kAround;
      const Vec3 n = height * kInward + across * (std::cos(angle) * u + std::sin(angle) * v);
      sum += field.traction(0.01 * n, kInward, n) *
             (1e-4 * 2.0 * 3.14159265358979 / (kPolar * kAround));
    }
  }
  EXPECT_LT((sum + Mat3::Identity()).norm(), 1e-3);
}

}  // namespace
}  // namespace viscera
