// A linear displacement field must come out exact to round-off, whatever the nodes.
#include <gtest/gtest.h>

#include "tests/kernels/paff/elastic_bodies.h"
#include "tests/support/paths.h"

namespace viscera {
namespace {

constexpr IsotropicMaterial kMaterial{10e3, 0.45};
constexpr double kRoundOff = 1e-12;

void expect_exact_linear_field(const test::Body& body,
                               const std::function<bool(const Vec3&)>& is_fixed,
                               const test::LinearField& field) {
  const auto system =
      GalerkinSystem::assemble(body.problem(kMaterial, is_fixed), 1.8, no_progress());
  ASSERT_TRUE(system) << system.error().text();
  const auto unknowns = system->solve(field.loads(kMaterial));
  ASSERT_TRUE(unknowns) << unknowns.error().text();
  EXPECT_LT(test::largest_error(*system, *unknowns, field), kRoundOff);
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

TEST(PatchTest, LinearFieldIsExactOnASphereWithGradedNodes) {
  const test::Body body = test::placed_body(
      test::icosphere(0.05, 3), graded_spacing(0.014, 0.006, 0.25, {Vec3(0.0, 0.0, 0.05)}));
  test::LinearField field;
  field.offset *= 0.05;
  expect_exact_linear_field(
      body, [](const Vec3& x) { return x.z() < -0.02; }, field);
}

TEST(PatchTest, LinearFieldIsExactOnAKidney) {
  const auto file = test::shared_data("visible_human/kidney_left_1080.obj");
  if (!file) GTEST_SKIP() << "the optional data folder is absent";
  TriangleSurface surface = test::read_simple_obj(file->string());
  const Box box = bounds(surface);
  for (Vec3& vertex : surface.vertices) vertex = (vertex - box.center()) / box.sizes().norm();
  const double h = std::cbrt(volume(surface) / 1000.0);
  const test::Body body = test::placed_body(surface, [h](const Vec3&) { return h; });
  expect_exact_linear_field(body, everywhere, {});
  expect_exact_linear_field(body, [](const Vec3& x) { return x.z() < -0.2; }, {});
}

}  // namespace
}  // namespace viscera
