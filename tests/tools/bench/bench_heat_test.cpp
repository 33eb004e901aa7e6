// The benchmark of heat, from end to end with few voxels.
#include <gtest/gtest.h>

#include <map>
#include <nlohmann/json.hpp>

#include "engine/gpu/egl_context.h"
#include "tests/support/paths.h"
#include "tests/support/program.h"

namespace viscera::test {
namespace {

TEST(BenchHeat, WritesErrorsTimesAndTheStandardBurn) {
  const TemporaryFolder folder;
  ProgramCall call;
  call.arguments = {"bench",
                    "heat",
                    "--quick",
                    "--json",
                    (folder / "heat.json").string(),
                    "--plot",
                    (folder / "plots").string()};
  call.cache = folder / "cache";
  const ProgramResult result = run_program(call);
  ASSERT_EQ(result.code, 0) << result.told();
  EXPECT_NE(result.out.find("standard burn"), std::string::npos) << result.told();
  const auto all = nlohmann::json::parse(file_text(folder / "heat.json"));
  // At each step, finer voxels err less.
  std::map<double, double> last;
  for (const auto& row : all["errors"]) {
    const double step = row["step_s"];
    if (last.contains(step)) {
      EXPECT_LT(row["error"].get<double>(), last[step]);
    }
    last[step] = row["error"];
  }
  ASSERT_FALSE(last.empty());
  for (const auto& [step, error] : last) EXPECT_LT(error, 0.02) << step;
  std::map<std::string, int> times;
  for (const auto& row : all["times"]) {
    EXPECT_GT(row["step_ms"].get<double>(), 0.0);
    EXPECT_FALSE(row["device"].get<std::string>().empty());
    ++times[row["backend"]];
  }
  EXPECT_EQ(times["cpu"], 2);
  const bool driver = static_cast<bool>(EglContext::create());
  EXPECT_EQ(times["gpu"], driver ? 2 : 0);
  EXPECT_NE(result.out.find(driver ? "on the GPU: " : "on the GPU: skipped"), std::string::npos);
  for (const auto& lesion : all["stiffness"]["lesions"]) {
    EXPECT_GT(lesion["nodes"], 10);
    EXPECT_LT(lesion["error"].get<double>(), 2e-5);
  }
  EXPECT_GT(all["burn"]["rows"].back()["depth_m"].get<double>(), 1e-3);
  EXPECT_LT(std::abs(all["burn"]["book"]["residual_J"].get<double>()), 0.1);
  for (const char* plot : {"heat_error.svg", "heat_time.svg", "heat_lesion.svg"})
    EXPECT_NE(file_text(folder / "plots" / plot).find("</svg>"), std::string::npos) << plot;
  expect_whole_files(folder.path());
}

TEST(BenchHeat, WithoutADriverSaysThatTheGpuIsSkippedAndTimesTheCpu) {
  const TemporaryFolder folder;
  const WithoutDrivers none;
  ProgramCall call;
  call.arguments = {"bench", "heat", "--quick", "--json", (folder / "heat.json").string()};
  call.cache = folder / "cache";
  const ProgramResult result = run_program(call);
  ASSERT_EQ(result.code, 0) << result.told();
  EXPECT_NE(result.out.find("on the GPU: skipped, no off-screen OpenGL"), std::string::npos)
      << result.told();
  for (const auto& row : nlohmann::json::parse(file_text(folder / "heat.json"))["times"])
    EXPECT_EQ(row["backend"], "cpu");
}

TEST(BenchHeat, RefusesAFileThatCantBeWrittenBeforeItMeasures) {
  const TemporaryFolder folder;
  ProgramCall call;
  call.arguments = {"bench", "heat", "--json", (folder / "none" / "heat.json").string()};
  call.cache = folder / "cache";
  expect_refused(run_program(call), {"heat.json"});
}

}  // namespace
}  // namespace viscera::test
