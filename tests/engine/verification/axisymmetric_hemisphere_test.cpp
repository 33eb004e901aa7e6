#include "engine/verification/axisymmetric_hemisphere.h"

#include <gtest/gtest.h>

#include "tests/support/paths.h"

namespace viscera {
namespace {

/// Coarser than the benchmark's, to be quick.
constexpr AxisymmetricMesh kCoarse{1e-3, 1.8, 0.1};

TEST(AxisymmetricHemisphere, AgreesWithTheIndependentReference) {
  const auto all = read_hemisphere_references(test::project_file("assets/reference/hemisphere"));
  ASSERT_TRUE(all) << all.error().text();
  for (const double nu : {0.30, 0.45}) {
    const HemisphereReference& known = *find_reference(*all, nu, 0.2);
    const auto solved = solve_axisymmetric_hemisphere(nu, 0.2, kCoarse);
    ASSERT_TRUE(solved) << solved.error().text();
    // The reference's own meshes differ by 0.3 % in force and 0.8 % at the pole.
    EXPECT_NEAR(solved->stick / known.stick, 1.0, 3e-3);
    EXPECT_NEAR(solved->frictionless / known.frictionless, 1.0, 3e-3);
    EXPECT_NEAR(solved->pressure_force / known.pressure_force, 1.0, 1e-4);
    const auto pole = [](const HemisphereReference& one) {
      return one.profile(HemisphereContact::kPress).at(Vec3::UnitZ()).z();
    };
    EXPECT_NEAR(pole(*solved) / pole(known), 1.0, 8e-3);
  }
}

TEST(AxisymmetricHemisphere, PatchMovesAsTheToolDoes) {
  const auto solved = solve_axisymmetric_hemisphere(0.4, 0.15, kCoarse);
  ASSERT_TRUE(solved) << solved.error().text();
  const Vec3 inside(std::sin(0.1), 0.0, std::cos(0.1));
  const Vec3 stuck = solved->profile(HemisphereContact::kStick).at(inside);
  EXPECT_NEAR((stuck - Vec3(0.0, 0.0, -kHemisphereDepth)).norm(), 0.0, 1e-12);
  const Vec3 slid = solved->profile(HemisphereContact::kFrictionless).at(inside);
  // Rows are joined by chords: of second order in their distance.
  EXPECT_NEAR(slid.dot(inside), -kHemisphereDepth * std::cos(0.1), 1e-4);
  EXPECT_GT((slid - stuck).norm(), 1e-5);
}

TEST(AxisymmetricHemisphere, RefusesWhatIsNoHemisphere) {
  EXPECT_FALSE(solve_axisymmetric_hemisphere(0.5, 0.2));
  EXPECT_FALSE(solve_axisymmetric_hemisphere(0.3, 0.0));
  EXPECT_FALSE(solve_axisymmetric_hemisphere(0.3, 1.0));
}

}  // namespace
}  // namespace viscera
