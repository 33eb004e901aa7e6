// The benchmark of hives, from end to end with few cases.
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "tests/support/paths.h"
#include "tests/support/program.h"

namespace viscera::test {
namespace {

ProgramResult bench_hive(std::vector<std::string> arguments, const TemporaryFolder& folder) {
  arguments.insert(arguments.begin(), {"bench", "hive"});
  ProgramCall call;
  call.arguments = std::move(arguments);
  call.cache = folder / "cache";
  return run_program(call);
}

TEST(BenchHive, WritesCasesErrorsAndPictures) {
  const TemporaryFolder folder;
  const auto file = folder / "hive.json", plots = folder / "plots";
  const ProgramResult result =
      bench_hive({"--quick", "--nodes", "28,80", "--radius", "0.4", "--poisson", "0.3", "--json",
                  file.string(), "--plot", plots.string()},
                 folder);
  ASSERT_EQ(result.code, 0) << result.err;
  const nlohmann::json all = nlohmann::json::parse(file_text(file));
  ASSERT_EQ(all["cases"].size(), 10u);  // five kinds, two sizes
  for (const auto& one : all["cases"]) {
    for (const char* key : {"build_us", "solve_us", "tick_us"})
      EXPECT_GT(one[key].get<double>(), 0.0) << one;
    EXPECT_EQ(one["radius_over_R"], 0.4);
    EXPECT_EQ(one["poisson"], 0.3);
    const double error = std::abs(one["force_error"].get<double>());
    EXPECT_TRUE(one["profile_error"].is_number());
    if (one["formulation"] == "subtracted" && one["periphery"] == "coupled") {
      EXPECT_LT(error, 0.02) << one;
    }
  }
  const auto& moving = all["moving"];
  EXPECT_GT(moving["nodes"].get<int>(), 60);
  EXPECT_GT(moving["ticks"].get<int>(), 1000);
  EXPECT_GT(moving["hives"].get<int>(), 2);
  EXPECT_GT(moving["greatest_force_N"].get<double>(), 0.01);
  EXPECT_GT(moving["compute_us"]["p99"].get<double>(), 0.0);
  ASSERT_EQ(all["beyond_linear"].size(),
            5u);  // one grid: three depths neo-Hookean, two of the other
  for (const auto& one : all["beyond_linear"]) {
    EXPECT_GT(one["tick_us"]["p99"].get<double>(), one["tick_us"]["p50"].get<double>() / 2.0)
        << one;
    EXPECT_GT(one["ticks"].get<int>(), 100) << one;
    EXPECT_LT(std::abs(one["force_error"].get<double>()), 0.08) << one;
  }
  EXPECT_GE(all["rows"].size(), 5u);
  EXPECT_TRUE(std::filesystem::exists(plots / "cost_against_unknowns.svg"));
  EXPECT_TRUE(std::filesystem::exists(plots / "force_against_radius_nu0.30.svg"));
}

TEST(BenchHive, NamesEveryOptionOutOfRange) {
  const TemporaryFolder folder;
  const ProgramResult result =
      bench_hive({"--nodes", "5", "--radius", "-1", "--poisson", "0.2"}, folder);
  EXPECT_EQ(result.code, 2);
  for (const char* option : {"--nodes: found 5", "--radius: found -1", "--poisson: found 0.2"})
    EXPECT_NE(result.err.find(option), std::string::npos) << result.err;
}

}  // namespace
}  // namespace viscera::test
