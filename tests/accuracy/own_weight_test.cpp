// A bar that hangs by its end, or stands out from a wall, under its own weight.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "tests/kernels/paff/elastic_bodies.h"
#include "tests/support/baselines.h"

namespace viscera {
namespace {

constexpr double kLength = 4.0, kWeight = 100.0;  // per volume
/// Without Poisson's ratio a held end doesn't disturb what hangs on it.
const IsotropicMaterial kMaterial{1e4, 0.0};

/// One unit wide and deep, from z = 0 to its held end at z = kLength.
test::Body bar(double spacing) {
  TriangleSurface surface = test::cube(1.0, 2);
  for (Vec3& x : surface.vertices) x.z() = kLength * (x.z() + 0.5);
  return test::placed_body(std::move(surface), [spacing](const Vec3&) { return spacing; });
}

/// Displacement at each node, and at the middle of the free end, under the weight along `way`.
struct Sag {
  std::vector<Vec3> nodes;
  Vec3 end = Vec3::Zero();
};

Sag sag(const test::Body& body, const Formulation& formulation, const Vec3& way) {
  const auto held = [](const Vec3& x) { return x.z() > kLength - 1e-9; };
  const auto unknowns =
      solve_static(formulation, body.problem(kMaterial, held),
                   {.body_force = [way](const Vec3&) { return Vec3(kWeight * way); },
                    .traction = {},
                    .held_displacement = {}});
  if (!unknowns) {
    ADD_FAILURE() << unknowns.error().text();
    return {std::vector<Vec3>(body.cloud.size(), Vec3::Constant(1e9)), Vec3::Constant(1e9)};
  }
  const ShapeFunctions fields = formulation.fields(body.cloud);
  const auto at = [&](const Vec3& x) {
    ShapeValues values;
    fields.evaluate(x, false, values);
    Vec3 sum = Vec3::Zero();
    for (std::size_t j = 0; j < values.nodes.size(); ++j)
      sum += values.values[j] * Vec3::Map(unknowns->data() + 3 * values.nodes[j]);
    return sum;
  };
  Sag answer;
  for (const Vec3& x : body.cloud.positions) answer.nodes.push_back(at(x));
  answer.end = at(Vec3::Zero());
  return answer;
}

/// Error of a hanging bar at its nodes over the greatest displacement:
/// u = -(w / E) (L s - s^2 / 2), s from the held end.
double hanging_error(const Formulation& formulation, double spacing) {
  const test::Body body = bar(spacing);
  const Sag found = sag(body, formulation, -Vec3::UnitZ());
  const double scale = kWeight / kMaterial.youngs_modulus;
  double error = 0.0;
  for (std::size_t i = 0; i < body.cloud.size(); ++i) {
    const double s = kLength - body.cloud.positions[i].z();
    const Vec3 exact(0.0, 0.0, -scale * (kLength * s - 0.5 * s * s));
    error = std::max(error, (found.nodes[i] - exact).norm());
  }
  return error / (scale * 0.5 * kLength * kLength);
}

TEST(OwnWeight, AHangingBarStretchesAsInTheClosedForm) {
  for (const char* name : {"galerkin", "galerkin_quadratic"}) {
    const double error = hanging_error(*find_formulation(name), 0.25);
    RecordProperty(name, std::to_string(error));
    EXPECT_LT(error, 3e-3) << name;
  }
}

TEST(OwnWeight, ByDifferencesItComesWithinAFifthOfIt) {
  if (!test::strong_forms_built_in()) GTEST_SKIP() << test::kNoStrongForms;
  const double error = hanging_error(*find_formulation("gfdm"), 0.25);
  RecordProperty("error", std::to_string(error));
  EXPECT_LT(error, 0.2);
}

TEST(OwnWeight, HalfTheSpacingLeavesAThirdOfTheErrorOrLess) {
  const Formulation& galerkin = *find_formulation("galerkin");
  const double coarse = hanging_error(galerkin, 0.4), fine = hanging_error(galerkin, 0.2);
  RecordProperty("coarse", std::to_string(coarse));
  RecordProperty("fine", std::to_string(fine));
  EXPECT_LT(fine, coarse / 3.0);
}

TEST(OwnWeight, ABarThatStandsOutSagsTheSameEitherWayAndAsABeam) {
  const test::Body body = bar(0.25);
  const Formulation& galerkin = *find_formulation("galerkin");
  const Vec3 x = sag(body, galerkin, Vec3::UnitX()).end;
  const Vec3 y = sag(body, galerkin, Vec3::UnitY()).end;
  EXPECT_NEAR(x.x(), y.y(), 0.01 * x.x());
  EXPECT_LT(std::hypot(x.y(), x.z()), 0.01 * x.x());
  // Timoshenko's beam: bending, w L^4 / (8 E I), and shear, w L^2 / (2 k G) with k = 5/6.
  const double bending = kWeight * std::pow(kLength, 4) * 12.0 / (8.0 * kMaterial.youngs_modulus);
  const double shear = kWeight * kLength * kLength * 1.2 / (2.0 * kMaterial.shear_modulus());
  EXPECT_NEAR(x.x(), bending + shear, 0.03 * (bending + shear));
}

TEST(OwnWeight, TheNodesTogetherCarryAllOfIt) {
  const test::Body body = bar(0.3);
  const auto system = GalerkinSystem::assemble(
      body.problem(kMaterial, [](const Vec3& x) { return x.z() > kLength - 1e-9; }), Basis::kLinear,
      1.8, no_progress());
  ASSERT_TRUE(system);
  const Vec3 way = Vec3(1.0, -2.0, 3.0).normalized();
  const std::vector<double> loads =
      system->loads({.body_force = [&](const Vec3&) { return Vec3(kWeight * way); },
                     .traction = {},
                     .held_displacement = {}});
  Vec3 sum = Vec3::Zero();
  for (std::size_t i = 0; i < loads.size(); i += 3) sum += Vec3::Map(loads.data() + i);
  EXPECT_LT((sum - kWeight * kLength * way).norm(), 1e-9 * kWeight * kLength);
}

}  // namespace
}  // namespace viscera
