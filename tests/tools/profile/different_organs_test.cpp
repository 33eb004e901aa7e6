// Organs of which no two are alike, as `viscera profile --different` steps them.
#include "tools/profile/different_organs.h"

#include <gtest/gtest.h>

#include <set>
#include <sstream>
#include <tuple>

namespace viscera {
namespace {

std::map<std::string, Tissue> rubber() {
  Tissue tissue;
  tissue.name = "rubber";
  tissue.elastic = {10e3, 0.45};
  return {{"rubber", tissue}};
}

TEST(DifferentOrgans, NoTwoHaveTheSameGeometry) {
  std::set<std::tuple<std::string, double, double>> shapes;
  for (const OrganDescription& organ : different_organs(256, "rubber").organs) {
    const auto& geometry = std::get<RecipeGeometry>(organ.geometry);
    shapes.emplace(geometry.recipe, geometry.radius, geometry.size.y());
  }
  EXPECT_EQ(shapes.size(), 256u);
}

TEST(DifferentOrgans, WhatIsntPreparedInTimeIsLeftOutAndTold) {
  std::ostringstream out;
  const DifferentOrgans options{
      .organs = {2, 30}, .seconds = 0.05, .most_prepare = 1e-3, .json = {}, .plots = {}};
  ASSERT_TRUE(profile_different("rubber", rubber(), options, out));
  EXPECT_NE(out.str().find("left out: 30 organs: 2 were prepared within 0 s"), std::string::npos)
      << out.str();
}

TEST(DifferentOrgans, NumbersThatCantBeAreRefused) {
  std::ostringstream out;
  const auto done = profile_different("rubber", rubber(), {.organs = {0}}, out);
  ASSERT_FALSE(done);
  EXPECT_NE(done.error().text().find("--different: found 0, expected from 1"), std::string::npos);
}

}  // namespace
}  // namespace viscera
