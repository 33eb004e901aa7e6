#include "engine/verification/hemisphere_reference.h"

#include <gtest/gtest.h>

#include <fstream>
#include <numbers>

#include "tests/support/paths.h"

namespace viscera {
namespace {

TEST(HemisphereReference, HoldsThreePoissonRatiosAndTwoRadii) {
  const auto all = read_hemisphere_references(test::project_file("assets/reference/hemisphere"));
  ASSERT_TRUE(all) << all.error().text();
  EXPECT_EQ(all->size(), 6u);
  for (const double nu : {0.30, 0.45, 0.49}) {
    for (const double a : {0.1, 0.2}) {
      const HemisphereReference* one = find_reference(*all, nu, a);
      ASSERT_TRUE(one);
      // The tool moves its patch by the depth.
      EXPECT_NEAR(one->profile(HemisphereContact::kStick).at(Vec3::UnitZ()).z(), -kHemisphereDepth,
                  1e-12);
      EXPECT_GT(one->force(HemisphereContact::kStick),
                one->force(HemisphereContact::kFrictionless));
      // The pressure's force is pi a^2 / 3.
      EXPECT_NEAR(one->force(HemisphereContact::kPress), std::numbers::pi * a * a / 3.0, 1e-6);
    }
  }
  EXPECT_FALSE(find_reference(*all, 0.40, 0.1));
  EXPECT_FALSE(find_reference(*all, 0.45, 0.15));
}

TEST(HemisphereProfile, TurnsAboutTheAxisAndInterpolates) {
  const HemisphereProfile profile({{0.0, 0.0, -1.0}, {0.5, 0.2, 0.0}, {1.0, 0.4, 1.0}});
  const Vec3 u = profile.at({0.0, -std::sin(0.75), std::cos(0.75)});
  EXPECT_NEAR(u.x(), 0.0, 1e-15);
  EXPECT_NEAR(u.y(), -0.3, 1e-12);
  EXPECT_NEAR(u.z(), 0.5, 1e-12);
  EXPECT_EQ(profile.at(Vec3::UnitZ()), Vec3(0.0, 0.0, -1.0));
}

TEST(HemisphereReference, NamesTheFileAndLineOfABrokenTable) {
  const test::TemporaryFolder folder;
  const auto missing = read_hemisphere_references(folder.path());
  ASSERT_FALSE(missing);
  EXPECT_NE(missing.error().text().find("forces.csv"), std::string::npos);
  std::ofstream(folder / "forces.csv") << "a,b,c,d,e,f\n1,2,3,4,5,6\n1,2,x,4,5,6\n";
  const auto broken = read_hemisphere_references(folder.path());
  ASSERT_FALSE(broken);
  EXPECT_NE(broken.error().text().find("forces.csv:3"), std::string::npos);
}

}  // namespace
}  // namespace viscera
