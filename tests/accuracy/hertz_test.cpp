// A rigid ball on a half-space [Hertz1882]: a = sqrt(R d), F = (4/3) E* sqrt(R) d^(3/2),
// p = p0 sqrt(1 - r^2 / a^2).
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "tests/accuracy/half_space_block.h"

namespace viscera {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr int kRings = 10;

/// Ball of radius R pressed until its contact has the radius a; cells reach a tenth beyond.
test::Answer press_ball(double radius, double a) {
  return test::press_block(test::plane_cells(Vec3(0.8e-3, 0.3e-3, test::kBlockTop),
                                             1.1 * a / kRings, kRings, radius, a * a / radius));
}

double hertz_force(double radius, double a) {
  return 4.0 / 3.0 * test::kHalfSpaceTissue.contact_modulus() * a * a * a / radius;
}

TEST(Hertz, ForceIsThatOfTheHalfSpace) {
  ASSERT_TRUE(test::half_space_block().ready);
  // The edge of contact is found to a cell, and the pressure vanishes there: the force misses
  // O(1 / rings^2); the ball is a sphere, not its paraboloid: (a / R)^2 / 4 at the edge.
  const double radius = 8e-3, a = 1.6e-3;
  const double cells = 1.0 / (kRings * kRings), shape = 0.25 * (a / radius) * (a / radius);
  const double large = press_ball(radius, a).force / hertz_force(radius, a) - 1.0;
  const double small = press_ball(radius, 0.5 * a).force / hertz_force(radius, 0.5 * a) - 1.0;
  std::printf("Hertz: force %+.2f %% at a, %+.2f %% at a / 2\n", 100.0 * large, 100.0 * small);
  EXPECT_LT(std::abs(large), test::finite_share(a) + cells + shape);
  EXPECT_LT(std::abs(2.0 * small - large), test::finite_share_extrapolated(a) + cells + shape);
}

TEST(Hertz, PressureIsTheHalfEllipsoid) {
  ASSERT_TRUE(test::half_space_block().ready);
  const double radius = 8e-3, a = 1.6e-3;
  const Vec3 centre(0.8e-3, 0.3e-3, test::kBlockTop);
  const auto cells = test::plane_cells(centre, 1.1 * a / kRings, kRings, radius, a * a / radius);
  const test::Answer answer = test::press_block(cells);
  const double peak = 2.0 * test::kHalfSpaceTissue.contact_modulus() * a / (kPi * radius);
  for (std::size_t k = 0; k < cells.size(); ++k) {
    const double r = (cells[k].position - centre).norm() / a;
    const double pressure = -answer.solution.forces[k].z() / cells[k].area;
    if (r < 0.85) {
      EXPECT_NEAR(pressure / peak, std::sqrt(1.0 - r * r), 0.05) << "at " << r << " a";
    } else if (r > 1.0 + 1.5 / kRings) {
      EXPECT_EQ(pressure, 0.0) << "at " << r << " a";
    }
  }
}

}  // namespace
}  // namespace viscera
