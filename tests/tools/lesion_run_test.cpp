// scenes/lesion_liver.json: how large a burn becomes, told by a run.
#include <gtest/gtest.h>

#include <sstream>

#include "tests/tools/tiny_scene.h"

namespace viscera::test {
namespace {

TEST(LesionRun, TheStandardBurnIsAsLargeAsItsTestHasIt) {
  const TemporaryFolder folder;
  const Json report = run_shipped_scene("lesion_liver", folder, {});
  ASSERT_FALSE(report.is_null());
  std::istringstream table(file_text(folder / "out" / "lesion.csv"));
  std::string line;
  std::getline(table, line);
  EXPECT_EQ(line,
            "time_s,depth_m,width_m,power_W,hottest_K,vaporised_kg,dead_depth_m,dead_width_m");
  double time = 0.0, depth = 0.0, width = 0.0, last = 0.0;
  int rows = 0;
  while (std::getline(table, line)) {
    char comma;
    std::istringstream(line) >> time >> comma >> depth >> comma >> width;
    EXPECT_GE(depth, 0.999 * last) << "damage never heals";
    last = depth;
    ++rows;
  }
  EXPECT_GT(rows, 180);
  // Published ones are 1.5 to 5 mm deep and 3 to 9.3 mm wide; this one is near the small end. What
  // moves it by more says so here.
  EXPECT_NEAR(depth, 1.54e-3, 0.05e-3);
  EXPECT_NEAR(width, 3.32e-3, 0.1e-3);
  const std::string plot = file_text(folder / "out" / "lesion.svg");
  for (const char* part : {"depth", "width", "dead", "greatest width", "KoreaMed1067937"})
    EXPECT_NE(plot.find(part), std::string::npos) << part;
  EXPECT_LT(std::abs(report["cautery"]["residual"].get<double>()), 0.01);
}

TEST(LesionRun, ARunThatDoesNotAskForItWritesNone) {
  const SceneFolder folder;
  const ProgramResult result = folder.run({"--no-render"});
  ASSERT_EQ(result.code, 0) << result.told();
  EXPECT_FALSE(std::filesystem::exists(folder.out() / "lesion.csv"));
}

}  // namespace
}  // namespace viscera::test
