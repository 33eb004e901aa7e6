// A hemisphere pressed over its cap, against the independent axisymmetric reference of the data
// folder. One cloud serves every contact radius and isn't aligned with any; the spread factor was
// chosen on a block and the patterns are fitted on the half-space, so nothing here was fitted.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>

#include "engine/verification/bodies.h"
#include "engine/verification/hemisphere_reference.h"
#include "tests/kernels/contact/bodies.h"
#include "tests/support/paths.h"

namespace viscera {
namespace {

constexpr double kRadius = 0.025, kModulus = 1e4;
constexpr double kDepth = 0.08 * kRadius;
constexpr int kRings = 6;

struct Pressed {
  std::vector<ContactCell> cells;
  ContactSolution solution;
  ContactResponse response;
  double force = 0.0;  ///< F / (E R delta)
};

/// The cap moved down whole, sticking or sliding.
Pressed press_cap(const test::PressedBody& body, double share, bool stick) {
  PatchContact contact(body.compliance, body.touch, body.material);
  const double reach = 2.0 * kRadius * std::sin(0.5 * std::asin(share));
  Pressed pressed;
  pressed.cells = cap_cells(kRadius, fitted_to_punch(ringed_disc(1.0, kRings), reach,
                                                     body.material.poisson_ratio, stick));
  for (ContactCell& cell : pressed.cells) {
    cell.held = stick;
    cell.displacement = Vec3(0, 0, -kDepth);
    cell.depth = kDepth * cell.normal.z();
  }
  contact.solve(pressed.cells, pressed.solution, pressed.response);
  EXPECT_TRUE(pressed.solution.converged);
  EXPECT_EQ(pressed.solution.touching, static_cast<int>(pressed.cells.size()));
  pressed.force = -test::total_force(pressed.solution).z() / (kModulus * kRadius * kDepth);
  return pressed;
}

/// Relative L2 error over the dome of the drawn displacement against the reference's.
double profile_error(const test::PressedBody& body, const Pressed& pressed,
                     const HemisphereProfile& reference) {
  std::vector<float> displacements;
  place_displacements(body.compliance, pressed.response, displacements);
  std::vector<Vec3f> positions, normals;
  deform_drawn_surface(body.drawn, displacements, pressed.solution.near_fields, pressed.cells,
                       pressed.solution.forces, positions, normals);
  double error = 0.0, size = 0.0;
  for (const auto& triangle : body.surface.triangles) {
    std::array<Vec3, 3> corner;
    for (std::size_t c = 0; c < 3; ++c) {
      corner[c] = body.surface.vertices[static_cast<std::size_t>(triangle[c])];
    }
    const double area = (corner[1] - corner[0]).cross(corner[2] - corner[0]).norm();
    if (corner[0].z() + corner[1].z() + corner[2].z() < 1e-9) continue;  // the base
    for (std::size_t c = 0; c < 3; ++c) {
      const Vec3& x = corner[c];
      const Vec3 expected = kRadius * reference.at(x.normalized());
      const Vec3 moved = positions[static_cast<std::size_t>(triangle[c])].cast<double>() - x;
      error += area * (moved - expected).squaredNorm();
      size += area * expected.squaredNorm();
    }
  }
  return std::sqrt(error / size);
}

struct Case {
  double poisson_ratio, force_bound, profile_bound;
};

class Hemisphere : public ::testing::TestWithParam<Case> {};

TEST_P(Hemisphere, ForcesAndProfilesAgreeWithTheReferenceForEveryRadius) {
  const auto [nu, force_bound, profile_bound] = GetParam();
  // Touched within 0.35 R of the axis.
  std::vector<Vec3> zone;
  for (const Vec2& place : ringed_disc(0.35, 12).places) {
    zone.push_back(kRadius * Vec3(place.x(), place.y(), std::sqrt(1.0 - place.squaredNorm())));
  }
  test::PressedBody body = test::prepare_body(
      ringed_hemisphere(kRadius, 28), IsotropicMaterial{kModulus, nu},
      graded_spacing(3.4e-3, 2.1e-3, 0.25, zone), [](const Vec3& x) { return x.z() < 1e-9; },
      [](const Vec3& x) { return x.z() > 0.85 * kRadius; }, true);
  ASSERT_TRUE(body.ready);
  EXPECT_LE(body.cloud.size(), 1100u);
  body.drawn.rest = &body.surface;
  const auto references =
      read_hemisphere_references(test::project_file("assets/reference/hemisphere"));
  ASSERT_TRUE(references) << references.error().text();
  int compared = 0;
  for (const HemisphereReference& reference : *references) {
    if (std::abs(reference.poisson_ratio - nu) > 1e-9) continue;
    for (const auto contact : {HemisphereContact::kStick, HemisphereContact::kFrictionless}) {
      const Pressed pressed =
          press_cap(body, reference.a_over_R, contact == HemisphereContact::kStick);
      const double force = pressed.force / reference.force(contact) - 1.0;
      const double profile = profile_error(body, pressed, reference.profile(contact));
      std::printf("hemisphere N %zu, nu %.2f, a %.1f R, %s: force %+.2f %%, profile %.2f %%\n",
                  body.cloud.size(), nu, reference.a_over_R, name_of(contact).data(), 100.0 * force,
                  100.0 * profile);
      EXPECT_NEAR(force, 0.0, force_bound);
      EXPECT_LT(profile, profile_bound);
      ++compared;
    }
  }
  EXPECT_GE(compared, 4);
}

INSTANTIATE_TEST_SUITE_P(PoissonRatios, Hemisphere,
                         ::testing::Values(Case{0.30, 0.03, 0.04}, Case{0.45, 0.03, 0.04},
                                           Case{0.49, 0.05, 0.08}));

}  // namespace
}  // namespace viscera
