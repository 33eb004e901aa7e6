#include "kernels/points/winding_number.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/shapes.h"

namespace viscera::test {
namespace {

TEST(WindingNumber, IsOneInsideAClosedSurfaceAndNoughtOutside) {
  const TriangleSurface ball = icosphere(0.05, 4);
  const WindingNumber winding(ball);
  for (int i = 0; i < 500; ++i) {
    const Vec3 direction = Vec3(std::sin(1.3 * i), std::sin(2.1 * i + 1), std::cos(0.7 * i));
    const double r = 0.1 * (i % 50) / 50.0;
    if (std::abs(r - 0.05) < 2e-3) continue;
    EXPECT_NEAR(winding(r * direction.normalized()), r < 0.05 ? 1.0 : 0.0, 0.03) << r;
  }
}

TEST(WindingNumber, OfAHemisphereIsItsSolidAngle) {
  TriangleSurface bowl = icosphere(0.05, 5);
  std::erase_if(bowl.triangles, [&bowl](const std::array<int, 3>& t) {
    return (bowl.vertices[t[0]] + bowl.vertices[t[1]] + bowl.vertices[t[2]]).z() > 0.0;
  });
  const WindingNumber winding(bowl);
  // On the axis at height z the disc over the bowl is seen under 2 pi (1 - z / sqrt(z2 + R2)), and
  // disc and bowl close each other.
  for (const double z : {-0.04, -0.02, 0.02, 0.05, 0.2}) {
    const double disc = 0.5 * (1.0 - std::abs(z) / std::hypot(z, 0.05));
    EXPECT_NEAR(winding(Vec3(0, 0, z)), z < 0.0 ? 1.0 - disc : disc, 0.02) << z;
  }
}

TEST(WindingNumber, FarAwayABowlIsTheDiscOverItWhereverBothStand) {
  TriangleSurface bowl = icosphere(0.05, 3);
  std::erase_if(bowl.triangles, [&bowl](const std::array<int, 3>& t) {
    return (bowl.vertices[t[0]] + bowl.vertices[t[1]] + bowl.vertices[t[2]]).z() > 0.0;
  });
  const Vec3 place(1.0, -2.0, 3.0);
  for (Vec3& vertex : bowl.vertices) vertex += place;
  const WindingNumber winding(bowl);
  // pi r2 / d2 of 4 pi, to a half of r / d.
  for (const double d : {1.0, 3.0, 8.0}) {
    const double disc = 0.25 * 0.05 * 0.05 / (d * d);
    EXPECT_NEAR(winding(place + Vec3(0, 0, d)), disc, 0.6 * 0.05 / d * disc + 0.05 * disc) << d;
  }
}

TEST(WindingNumber, OfNothingIsNought) {
  EXPECT_EQ(WindingNumber(TriangleSurface{})(Vec3::Zero()), 0.0);
}

}  // namespace
}  // namespace viscera::test
