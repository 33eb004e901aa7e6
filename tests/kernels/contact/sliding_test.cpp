// A small tip must not feel where the nodes are.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>

#include "tests/kernels/contact/bodies.h"
#include "tests/support/shapes.h"

namespace viscera {
namespace {

const IsotropicMaterial kTissue{1e4, 0.45};

struct Slide {
  double mean = 0.0;    ///< [N]
  double ripple = 0.0;  ///< greatest less smallest force, relative to the mean
};

template <class CellsAt>
Slide slide(const test::PressedBody& body, int places, const CellsAt& cells_at) {
  PatchContact contact(body.compliance, body.touch, body.material);
  ContactSolution solution;
  ContactResponse response;
  double least = 1e300, greatest = 0.0, sum = 0.0;
  for (int i = 0; i < places; ++i) {
    contact.solve(cells_at(i / static_cast<double>(places)), solution, response);
    EXPECT_TRUE(solution.converged);
    EXPECT_EQ(solution.beyond_touchable, 0);
    const double force = test::total_force(solution).norm();
    least = std::min(least, force);
    greatest = std::max(greatest, force);
    sum += force;
  }
  return {sum / places, (greatest - least) / (sum / places)};
}

/// A 1 mm ball over the top of a block, across some three node spacings.
Slide slide_on_block(double spacing) {
  const double top = 0.012;
  const test::PressedBody body =
      test::prepare_block(Vec3(0.04, 0.04, 2.0 * top), spacing, 0.016, kTissue);
  return slide(body, 40, [&](double share) {
    const Vec3 centre(-5e-3 + 10e-3 * share, 2e-3 * std::sin(5.0 * share), top);
    return test::plane_cells(centre, 0.26e-3, 3, 1e-3, 0.5e-3);
  });
}

/// Cells of the same tool where it presses a ball of `radius` about the origin along -axis.
std::vector<ContactCell> ball_cells(double radius, const Vec3& axis, double tip, double depth) {
  auto cells = test::plane_cells(Vec3::Zero(), 0.26e-3, 3, tip, depth);
  const Quaternion turn = Quaternion::FromTwoVectors(Vec3::UnitZ(), axis);
  for (ContactCell& cell : cells) {
    const double fall = radius - std::sqrt(radius * radius - cell.position.squaredNorm());
    cell.normal = turn * (cell.position + (radius - fall) * Vec3::UnitZ()).normalized();
    cell.position = radius * cell.normal;
    cell.direction = -axis;
    cell.depth -= fall;
  }
  return cells;
}

Slide slide_on_ball(double spacing) {
  const double radius = 0.016;
  const test::PressedBody body = test::prepare_body(
      test::icosphere(radius, 4), kTissue, [=](const Vec3&) { return spacing; },
      [=](const Vec3& x) { return x.z() < -0.5 * radius; },
      [=](const Vec3& x) { return x.z() > 0.4 * radius; });
  return slide(body, 40, [&](double share) {
    // A circle of latitude: the body answers the same all along it.
    const double angle = 2.0 * std::numbers::pi * share;
    const Vec3 axis(std::sin(0.25) * std::cos(angle), std::sin(0.25) * std::sin(angle),
                    std::cos(0.25));
    return ball_cells(radius, axis, 1e-3, 0.5e-3);
  });
}

TEST(Sliding, TipOnABlockFeelsNoNodes) {
  const Slide coarse = slide_on_block(4e-3), fine = slide_on_block(2.7e-3);
  std::printf("block: h 4 mm %.4g N, ripple %.2f %%; h 2.7 mm %.4g N, ripple %.2f %%\n",
              coarse.mean, 100.0 * coarse.ripple, fine.mean, 100.0 * fine.ripple);
  EXPECT_LT(coarse.ripple, 0.01);
  EXPECT_LT(fine.ripple, 0.01);
  EXPECT_NEAR(fine.mean / coarse.mean, 1.0, 0.02);
}

TEST(Sliding, TipOnABallFeelsNoNodesAndHalvingTheSpacingKeepsTheForce) {
  const Slide coarse = slide_on_ball(4e-3), fine = slide_on_ball(2e-3);
  std::printf("ball: h 4 mm %.4g N, ripple %.2f %%; h 2 mm %.4g N, ripple %.2f %%\n", coarse.mean,
              100.0 * coarse.ripple, fine.mean, 100.0 * fine.ripple);
  EXPECT_LT(coarse.ripple, 0.05);
  EXPECT_LT(fine.ripple, 0.05);
  EXPECT_NEAR(fine.mean / coarse.mean, 1.0, 0.10);
}

}  // namespace
}  // namespace viscera
