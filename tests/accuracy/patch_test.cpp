// The polynomials of a formulation's basis must come out exact to round-off, whatever the nodes.
#include <gtest/gtest.h>

#include "tests/kernels/paff/elastic_bodies.h"
#include "tests/support/paths.h"

namespace viscera {
namespace {

constexpr IsotropicMaterial kMaterial{10e3, 0.45};     // dilatation averaged
constexpr IsotropicMaterial kCompressible{10e3, 0.3};  // and not
constexpr double kRoundOff = 1e-12;

void expect_exact_linear_field(const test::Body& body,
                               const std::function<bool(const Vec3&)>& is_fixed,
                               const test::LinearField& field,
                               const IsotropicMaterial& material = kMaterial) {
  const auto system =
      GalerkinSystem::assemble(body.problem(material, is_fixed), 1.8, no_progress());
  ASSERT_TRUE(system) << system.error().text();
  const auto unknowns = system->solve(field.loads(material));
  ASSERT_TRUE(unknowns) << unknowns.error().text();
  EXPECT_LT(test::largest_error(*system, *unknowns, field), kRoundOff);
}

/// Round-off grows with the condition of the moments (some 1e4 with ten polynomials).
constexpr double kQuadraticRoundOff = 1e-10;

void expect_exact_quadratic_field(const test::Body& body,
                                  const std::function<bool(const Vec3&)>& is_fixed,
                                  const test::QuadraticField& field) {
  const auto system =
      GalerkinSystem::assemble(body.problem(kMaterial, is_fixed), Basis::kQuadratic,
                               galerkin_quadratic_formulation().support_factor(), no_progress());
  ASSERT_TRUE(system) << system.error().text();
  const auto unknowns = system->solve(field.loads(kMaterial));
  ASSERT_TRUE(unknowns) << unknowns.error().text();
  EXPECT_LT(test::largest_error(*system, *unknowns, field), kQuadraticRoundOff);
}

bool everywhere(const Vec3&) {
  return true;
}

TEST(PatchTest, LinearFieldIsExactOnAJitteredCubeHeldEverywhere) {
  expect_exact_linear_field(test::jittered_cube(7, 0.3), everywhere, {});
}

TEST(PatchTest, LinearFieldIsExactOnAJitteredCubeWithTractions) {
  expect_exact_linear_field(test::jittered_cube(7, 0.3),
                            [](const Vec3& x) { return x.z() < -0.5 + 1e-9; }, {});
}

TEST(PatchTest, LinearFieldIsExactOnAJitteredCubeOfACompressibleMaterial) {
  expect_exact_linear_field(
      test::jittered_cube(7, 0.3), [](const Vec3& x) { return x.z() < -0.5 + 1e-9; }, {},
      kCompressible);
}

TEST(PatchTest, LinearFieldIsExactOnASphereWithGradedNodes) {
  const test::Body body = test::placed_body(
      test::icosphere(0.05, 3), graded_spacing(0.014, 0.006, 0.25, {Vec3(0.0, 0.0, 0.05)}));
  test::LinearField field;
  field.offset *= 0.05;
  expect_exact_linear_field(
      body, [](const Vec3& x) { return x.z() < -0.02; }, field);
}

TEST(PatchTest, QuadraticFieldIsExactOnAJitteredCubeWithTractions) {
  expect_exact_quadratic_field(test::jittered_cube(6, 0.3),
                               [](const Vec3& x) { return x.z() < -0.5 + 1e-9; }, {});
}

TEST(PatchTest, QuadraticFieldIsExactOnASphereWithGradedNodes) {
  test::Body body = test::placed_body(test::icosphere(1.0, 2),
                                      graded_spacing(0.4, 0.25, 0.25, {Vec3(0.0, 0.0, 1.0)}));
  expect_exact_quadratic_field(body, [](const Vec3& x) { return x.z() < -0.4; }, {});
}

/// An organ of the optional data folder with its diagonal scaled to 1; nothing where it is absent.
std::optional<TriangleSurface> scaled_organ(const std::string& name) {
  const auto file = test::shared_data("visible_human/" + name + ".obj");
  if (!file) return std::nullopt;
  TriangleSurface surface = test::read_simple_obj(file->string());
  const Box box = bounds(surface);
  for (Vec3& vertex : surface.vertices) vertex = (vertex - box.center()) / box.sizes().norm();
  return surface;
}

test::Body with_nodes(const TriangleSurface& surface, double count) {
  const double h = std::cbrt(volume(surface) / count);
  return test::placed_body(surface, [h](const Vec3&) { return h; });
}

class OrganPatchTest : public testing::TestWithParam<const char*> {};

TEST_P(OrganPatchTest, LinearFieldIsExact) {
  const auto surface = scaled_organ(GetParam());
  if (!surface) GTEST_SKIP() << "the optional data folder is absent";
  const test::Body body = with_nodes(*surface, 700.0);
  expect_exact_linear_field(body, [](const Vec3& x) { return x.z() < -0.15; }, {});
}

TEST_P(OrganPatchTest, QuadraticFieldIsExact) {
  const auto surface = scaled_organ(GetParam());
  if (!surface) GTEST_SKIP() << "the optional data folder is absent";
  expect_exact_quadratic_field(with_nodes(*surface, 300.0),
                               [](const Vec3& x) { return x.z() < -0.1; }, {});
}

INSTANTIATE_TEST_SUITE_P(Organs, OrganPatchTest, testing::Values("kidney_left_1080", "liver_2k"));

}  // namespace
}  // namespace viscera
