// A hemisphere pressed over its cap, against the independent axisymmetric reference of the data
// folder. One cloud serves every contact radius and isn't aligned with any; the spread factor was
// chosen on a block and the patterns are fitted on the half-space, so nothing here was fitted.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <fstream>
#include <numbers>
#include <sstream>

#include "tests/kernels/contact/bodies.h"
#include "tests/support/paths.h"

namespace viscera {
namespace {

constexpr double kRadius = 0.025, kModulus = 1e4;
constexpr double kDepth = 0.08 * kRadius;
constexpr int kRings = 6;

/// Rows of numbers below a header.
std::vector<std::vector<double>> read_table(const std::string& name) {
  std::ifstream file(test::project_file("assets/reference/hemisphere/" + name));
  EXPECT_TRUE(file) << name;
  std::string line;
  std::getline(file, line);
  std::vector<std::vector<double>> rows;
  while (std::getline(file, line)) {
    for (char& c : line) c = c == ',' ? ' ' : c;
    std::istringstream text(line);
    rows.emplace_back();
    for (double value = 0.0; text >> value;) rows.back().push_back(value);
  }
  return rows;
}

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
  pressed.cells = test::cap_cells(kRadius, fitted_to_punch(ringed_disc(1.0, kRings), reach,
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
                     const std::vector<std::vector<double>>& reference) {
  std::vector<float> unknowns;
  displacement_unknowns(body.compliance, pressed.response, unknowns);
  std::vector<Vec3f> positions, normals;
  deform_drawn_surface(body.drawn, unknowns, pressed.solution.near_fields, pressed.cells,
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
      const double across = std::hypot(x.x(), x.y());
      const double polar = std::min(std::atan2(across, x.z()), reference.back()[0]);
      std::size_t i = 1;
      while (i + 1 < reference.size() && reference[i][0] < polar) ++i;
      const auto &low = reference[i - 1], &high = reference[i];
      const double t = (polar - low[0]) / (high[0] - low[0]);
      const Vec3 outward = across > 0.0 ? Vec3(x.x() / across, x.y() / across, 0.0) : Vec3::Zero();
      const Vec3 expected = kRadius * (((1.0 - t) * low[1] + t * high[1]) * outward +
                                       ((1.0 - t) * low[2] + t * high[2]) * Vec3::UnitZ());
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
      test::hemisphere(kRadius, 28), IsotropicMaterial{kModulus, nu},
      graded_spacing(3.4e-3, 2.1e-3, 0.25, zone), [](const Vec3& x) { return x.z() < 1e-9; },
      [](const Vec3& x) { return x.z() > 0.85 * kRadius; }, true);
  ASSERT_TRUE(body.ready);
  EXPECT_LE(body.cloud.size(), 1100u);
  body.drawn.rest = &body.surface;
  for (const auto& row : read_table("forces.csv")) {
    if (std::abs(row[1] - nu) > 1e-9) continue;
    for (const bool stick : {true, false}) {
      const Pressed pressed = press_cap(body, row[0], stick);
      char name[64];
      std::snprintf(name, sizeof name, "%s_nu%.2f_a%.1f.csv", stick ? "stick" : "norm", nu, row[0]);
      const double force = pressed.force / row[stick ? 2 : 3] - 1.0;
      const double profile = profile_error(body, pressed, read_table(name));
      std::printf("hemisphere N %zu, nu %.2f, a %.1f R, %s: force %+.2f %%, profile %.2f %%\n",
                  body.cloud.size(), nu, row[0], stick ? "stick" : "frictionless", 100.0 * force,
                  100.0 * profile);
      EXPECT_NEAR(force, 0.0, force_bound);
      EXPECT_LT(profile, profile_bound);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(PoissonRatios, Hemisphere,
                         ::testing::Values(Case{0.30, 0.03, 0.04}, Case{0.45, 0.03, 0.04},
                                           Case{0.49, 0.05, 0.08}));

}  // namespace
}  // namespace viscera
