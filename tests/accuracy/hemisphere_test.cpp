// A hemisphere on its flat base under a smooth pressure about the pole, against a converged
// axisymmetric solution (assets/reference/hemisphere/README.md).
#include <gtest/gtest.h>

#include "engine/verification/hemisphere_reference.h"
#include "tests/kernels/paff/elastic_bodies.h"
#include "tests/support/paths.h"

namespace viscera {
namespace {

class PressedHemisphere : public testing::TestWithParam<double> {};

TEST_P(PressedHemisphere, PoleSinksAsInTheReference) {
  constexpr double kPatch = 0.2;
  const double poisson_ratio = GetParam();
  const auto references =
      read_hemisphere_references(test::project_file("assets/reference/hemisphere"));
  ASSERT_TRUE(references) << references.error().text();
  const HemisphereReference* reference = find_reference(*references, poisson_ratio, kPatch);
  ASSERT_TRUE(reference);
  const Vec3 pole(0.0, 0.0, 1.0);
  const test::Body body =
      test::placed_body(ringed_hemisphere(1.0, 20), graded_spacing(0.15, 0.045, 0.25, {pole}));
  const auto system = GalerkinSystem::assemble(
      body.problem({1.0, poisson_ratio}, [](const Vec3& x) { return x.z() < 1e-9; }),
      galerkin_formulation().support_factor(), no_progress());
  ASSERT_TRUE(system) << system.error().text();

  StaticLoads loads;
  loads.traction = [](const Vec3& x, const Vec3& n) {
    const double s2 = (x.x() * x.x() + x.y() * x.y()) / (kPatch * kPatch);
    return s2 < 1.0 ? Vec3(-(1.0 - s2) * (1.0 - s2) * n) : Vec3(Vec3::Zero());
  };
  const auto unknowns = system->solve(loads);
  ASSERT_TRUE(unknowns) << unknowns.error().text();
  const double sunk = system->displacement(*unknowns, pole).z();
  const double expected = reference->profile(HemisphereContact::kPress).at(pole).z();
  RecordProperty("nodes", std::to_string(body.cloud.size()));
  RecordProperty("error", std::to_string(sunk / expected - 1.0));
  EXPECT_NEAR(sunk / expected, 1.0, 0.04) << body.cloud.size() << " nodes";
}

INSTANTIATE_TEST_SUITE_P(Poisson, PressedHemisphere, testing::Values(0.30, 0.45));

}  // namespace
}  // namespace viscera
