// Forces on the hemisphere against the independent axisymmetric reference of the data folder: the
// spread factor was chosen on a block, so nothing here was fitted.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <fstream>
#include <sstream>

#include "tests/kernels/contact/bodies.h"
#include "tests/support/paths.h"

namespace viscera {
namespace {

constexpr double kRadius = 0.025, kModulus = 1e4;
constexpr double kDepth = 0.08 * kRadius;

struct Reference {
  double share = 0.0, poisson_ratio = 0.0;  ///< a / R
  double stick = 0.0, frictionless = 0.0;   ///< F / (E R delta)
};

std::vector<Reference> read_references(const std::filesystem::path& path) {
  std::ifstream file(path);
  std::string line;
  std::getline(file, line);
  std::vector<Reference> all;
  while (std::getline(file, line)) {
    for (char& c : line) c = c == ',' ? ' ' : c;
    Reference one;
    std::istringstream(line) >> one.share >> one.poisson_ratio >> one.stick >> one.frictionless;
    all.push_back(one);
  }
  return all;
}

/// F / (E R delta) of the cap moved down whole, sticking or sliding.
double cap_force(const test::PressedBody& body, double share, bool stick) {
  PatchContact contact(body.compliance, body.touch, body.material);
  auto cells = test::cap_cells(kRadius, std::asin(share), 6);
  for (ContactCell& cell : cells) {
    cell.held = stick;
    cell.displacement = Vec3(0, 0, -kDepth);
    cell.depth = kDepth * cell.normal.z();
  }
  ContactSolution solution;
  ContactResponse response;
  contact.solve(cells, solution, response);
  EXPECT_TRUE(solution.converged);
  EXPECT_EQ(solution.touching, static_cast<int>(cells.size()));
  return -test::total_force(solution).z() / (kModulus * kRadius * kDepth);
}

class Hemisphere : public ::testing::TestWithParam<double> {};

TEST_P(Hemisphere, ForcesAgreeWithTheReference) {
  const auto path = test::project_file("assets/reference/hemisphere/forces.csv");
  const double nu = GetParam();
  const test::PressedBody body = test::prepare_body(
      test::hemisphere(kRadius, 32), IsotropicMaterial{kModulus, nu},
      [](const Vec3&) { return 3.2e-3; }, [](const Vec3& x) { return x.z() < 1e-9; },
      [](const Vec3& x) { return x.z() > 0.6 * kRadius; });
  ASSERT_TRUE(body.ready);
  for (const Reference& one : read_references(path)) {
    if (std::abs(one.poisson_ratio - nu) > 1e-9) continue;
    const double stick = cap_force(body, one.share, true) / one.stick - 1.0;
    const double slide = cap_force(body, one.share, false) / one.frictionless - 1.0;
    std::printf("hemisphere N %zu, nu %.2f, a %.1f R: stick %+.1f %%, frictionless %+.1f %%\n",
                body.cloud.size(), nu, one.share, 100.0 * stick, 100.0 * slide);
    EXPECT_NEAR(stick, 0.0, 0.06);
    EXPECT_NEAR(slide, 0.0, 0.04);
  }
}

INSTANTIATE_TEST_SUITE_P(PoissonRatios, Hemisphere, ::testing::Values(0.30, 0.45));

}  // namespace
}  // namespace viscera
