// A body's answer as its Poisson's ratio passes those from which its dilatation is averaged
// (kernels/paff/galerkin.h): the hemisphere of hemisphere_test.cpp under its smooth pressure.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "engine/verification/axisymmetric_hemisphere.h"
#include "tests/kernels/paff/elastic_bodies.h"

namespace viscera {
namespace {

constexpr double kPatch = 0.2;
const Vec3 kPole(0.0, 0.0, 1.0);

/// How far the pole sinks under the pressure 1, over R / E; NaN where it can't be solved.
double sunk(const test::Body& body, double poisson_ratio) {
  const auto system = GalerkinSystem::assemble(
      body.problem({1.0, poisson_ratio}, [](const Vec3& x) { return x.z() < 1e-9; }),
      galerkin_formulation().support_factor(), no_progress());
  StaticLoads loads;
  loads.traction = [](const Vec3& x, const Vec3& n) {
    const double s2 = (x.x() * x.x() + x.y() * x.y()) / (kPatch * kPatch);
    return s2 < 1.0 ? Vec3(-(1.0 - s2) * (1.0 - s2) * n) : Vec3(Vec3::Zero());
  };
  const auto unknowns = system ? system->solve(loads) : std::unexpected(system.error());
  if (!unknowns) return std::numeric_limits<double>::quiet_NaN();
  return -system->displacement(*unknowns, kPole).z();
}

test::Body hemisphere(double coarsest, double finest) {
  return test::placed_body(ringed_hemisphere(1.0, 20),
                           graded_spacing(coarsest, finest, 0.25, {kPole}));
}

/// By how much the slope of the answer over Poisson's ratio differs on both sides, each taken over
/// `step`.
double slope_change(const test::Body& body, double poisson_ratio, double step) {
  return std::abs(sunk(body, poisson_ratio - step) - 2.0 * sunk(body, poisson_ratio) +
                  sunk(body, poisson_ratio + step)) /
         step;
}

// Coarse on purpose: the load is narrower than the nodes are apart, so that averages change most.
TEST(PoissonsRatio, NeitherTheAnswerNorItsSlopeJumps) {
  const test::Body body = hemisphere(0.2, 0.12);
  const double slope = std::abs(sunk(body, 0.29) - sunk(body, 0.28)) / 0.01;
  for (const double at : {0.30, 0.33, 0.36, 0.38, 0.40, 0.42}) {
    // Where the slope jumps it does so over any step, and a jump of the answer is steeper the
    // shorter the step is; a smooth answer's slope changes by as much less as the step is shorter.
    const double wide = slope_change(body, at, 2e-3), narrow = slope_change(body, at, 2e-4);
    RecordProperty("narrow_at_" + std::to_string(at), std::to_string(narrow / slope));
    EXPECT_LT(wide, 0.1 * slope) << at;
    EXPECT_LT(narrow, 0.2 * wide + 1e-4 * slope) << at;
    EXPECT_LT(narrow, 0.01 * slope) << at;
  }
}

TEST(PoissonsRatio, BetweenItsEndsTheAnswerRisesAsAConvergedReferenceDoes) {
  const test::Body body = hemisphere(0.15, 0.045);
  const auto low = solve_axisymmetric_hemisphere(0.38, kPatch);
  const auto high = solve_axisymmetric_hemisphere(0.42, kPatch);
  ASSERT_TRUE(low && high);
  const auto exact = [](const HemisphereReference& reference) {
    return -reference.profile(HemisphereContact::kPress).at(kPole).z();
  };
  const double at_low = sunk(body, 0.38), at_high = sunk(body, 0.42);
  const double reference = exact(*low) - exact(*high);
  RecordProperty("stiffening_over_the_reference", std::to_string((at_low - at_high) / reference));
  EXPECT_NEAR((at_low - at_high) / reference, 1.0, 0.25);
  EXPECT_NEAR(at_low / exact(*low), 1.0, 0.015);
  EXPECT_NEAR(at_high / exact(*high), 1.0, 0.015);
}

}  // namespace
}  // namespace viscera
