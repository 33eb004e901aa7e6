// The benchmark of cuts, from end to end with few nodes.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "tests/support/paths.h"
#include "tests/support/program.h"

namespace viscera::test {
namespace {

TEST(BenchCut, WritesWhatEachCutErrsByAndWhatItTakesToPrepare) {
  const TemporaryFolder folder;
  ProgramCall call;
  call.arguments = {"bench",
                    "cut",
                    "--quick",
                    "--json",
                    (folder / "cut.json").string(),
                    "--plot",
                    (folder / "plots").string()};
  call.cache = folder / "cache";
  const ProgramResult result = run_program(call);
  ASSERT_EQ(result.code, 0) << result.told();
  EXPECT_NE(result.out.find("slit half through"), std::string::npos) << result.told();
  const auto all = nlohmann::json::parse(file_text(folder / "cut.json"));
  int forces = 0, openings = 0;
  for (const auto& one : all["cases"]) {
    EXPECT_FALSE(one["case"].get<std::string>().empty());
    EXPECT_GE(one["spacing_m"].get<double>(), 2e-3);
    EXPECT_GT(one["worker_ms"].get<double>(), 0.0);
    EXPECT_TRUE(one["frame_ms"].is_null()) << "no scene";
    EXPECT_TRUE(one["frames_late"].is_null());
    if (!one["force_error"].is_null()) {
      ++forces;
      EXPECT_LT(one["force_error"].get<double>(), 0.1) << one["case"];
    }
    if (!one["opening_error"].is_null()) {
      ++openings;
      EXPECT_LT(one["opening_error"].get<double>(), 0.08) << one["case"];
    }
  }
  EXPECT_EQ(forces, 6);
  EXPECT_EQ(openings, 3);
  EXPECT_GE(all["rows"].size(), 2u);
  for (const char* plot : {"cut_error.svg", "cut_time.svg", "penny_crack.svg"})
    EXPECT_NE(file_text(folder / "plots" / plot).find("</svg>"), std::string::npos) << plot;
  expect_whole_files(folder.path());
}

}  // namespace
}  // namespace viscera::test
