// scenes/lesion_liver.json: how large a burn becomes, told by a run.
#include <gtest/gtest.h>

#include <sstream>
#include <string>
#include <vector>

#include "tests/tools/tiny_scene.h"

namespace viscera::test {
namespace {

/// The sizes in lesion.csv, row by row [m].
struct Sizes {
  std::vector<double> depth, width, dead_depth, dead_width;
};
Sizes sizes_in(const std::filesystem::path& file) {
  std::istringstream table(file_text(file));
  std::string line;
  std::getline(table, line);
  EXPECT_EQ(line,
            "time_s,depth_m,width_m,power_W,hottest_K,vaporised_kg,dead_depth_m,dead_width_m");
  Sizes sizes;
  while (std::getline(table, line)) {
    std::istringstream row(line);
    std::vector<double> values;
    for (std::string value; std::getline(row, value, ',');) values.push_back(std::stod(value));
    EXPECT_EQ(values.size(), 8u);
    if (values.size() != 8) break;
    sizes.depth.push_back(values[1]);
    sizes.width.push_back(values[2]);
    sizes.dead_depth.push_back(values[6]);
    sizes.dead_width.push_back(values[7]);
  }
  return sizes;
}

/// At the end [m].
struct Lesion {
  double depth, width, dead_depth, dead_width;
};

/// What the shipped burn leaves behind comes to `expected`, and grows to that.
Json burn(const std::vector<std::string>& options, const Lesion& expected) {
  const TemporaryFolder folder;
  const Json report = run_shipped_scene("lesion_liver", folder, options);
  const Sizes sizes = sizes_in(folder / "out" / "lesion.csv");
  EXPECT_GT(sizes.depth.size(), 180u);
  if (report.is_null() || sizes.depth.empty()) return report;
  for (std::size_t i = 1; i < sizes.depth.size(); ++i) {
    EXPECT_GE(sizes.depth[i], 0.999 * sizes.depth[i - 1]) << "damage never heals";
    EXPECT_GE(sizes.dead_depth[i], sizes.depth[i]) << "what has blanched is dead";
  }
  EXPECT_NEAR(sizes.depth.back(), expected.depth, 0.05e-3);
  EXPECT_NEAR(sizes.width.back(), expected.width, 0.1e-3);
  EXPECT_NEAR(sizes.dead_depth.back(), expected.dead_depth, 0.05e-3);
  EXPECT_NEAR(sizes.dead_width.back(), expected.dead_width, 0.1e-3);
  const std::string plot = file_text(folder / "out" / "lesion.svg");
  for (const char* part : {"depth", "width", "dead", "greatest width", "KoreaMed1067937"})
    EXPECT_NE(plot.find(part), std::string::npos) << part;
  EXPECT_LT(std::abs(report["cautery"]["residual"].get<double>()), 0.01);
  return report;
}

// The tip is held in its place; as collagen shrinks the surface sinks from it, and contact and
// current with it. What moves the lesion by more than its digits says so here.
TEST(LesionRun, ATipThatIsHeldInPlaceBurnsUntilTheSurfaceHasSunkFromIt) {
  const Json report = burn({}, {1.32e-3, 2.89e-3, 1.69e-3, 3.54e-3});
  ASSERT_FALSE(report.is_null());
  EXPECT_TRUE(report["tissue"][0]["stiffening"]["greatest_shrinkage_m"].is_null())
      << "at finite strain the surface's sinking isn't told apart";
}

TEST(LesionRun, LinearTissueSinksFromItSooner) {
  const Json report =
      burn({"--set", "organs/liver/response=linear"}, {1.20e-3, 2.56e-3, 1.55e-3, 3.18e-3});
  ASSERT_FALSE(report.is_null());
  EXPECT_GT(report["tissue"][0]["stiffening"]["greatest_shrinkage_m"], 0.4e-3)
      << "it was pressed in by half a millimetre";
}

TEST(LesionRun, WhereNothingSinksItIsAsLargeAsTheStandardBurn) {
  const TemporaryFolder folder;
  const Json report =
      run_shipped_scene("lesion_liver", folder, {"--set", "organs/liver/stiffens=false"});
  ASSERT_FALSE(report.is_null());
  const Sizes sizes = sizes_in(folder / "out" / "lesion.csv");
  ASSERT_FALSE(sizes.depth.empty());
  // The spans of the test of that burn.
  EXPECT_NEAR(sizes.depth.back(), 1.48e-3, 0.11e-3);
  EXPECT_NEAR(sizes.width.back(), 3.44e-3, 0.15e-3);
}

TEST(LesionRun, ARunThatDoesNotAskForItWritesNone) {
  const SceneFolder folder;
  const ProgramResult result = folder.run({"--no-render"});
  ASSERT_EQ(result.code, 0) << result.told();
  EXPECT_FALSE(std::filesystem::exists(folder.out() / "lesion.csv"));
}

}  // namespace
}  // namespace viscera::test
