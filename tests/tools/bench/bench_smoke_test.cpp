// The benchmark of smoke, from end to end with few particles.
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <set>

#include "engine/gpu/egl_context.h"
#include "tests/support/paths.h"
#include "tests/support/program.h"

namespace viscera::test {
namespace fs = std::filesystem;
namespace {

class BenchSmoke : public testing::Test {
 protected:
  ProgramCall call(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), {"bench", "smoke"});
    ProgramCall call;
    call.arguments = std::move(arguments);
    call.cache = folder_ / "cache";
    return call;
  }
  ProgramResult run(std::vector<std::string> arguments) {
    return run_program(call(std::move(arguments)));
  }
  nlohmann::json json() { return nlohmann::json::parse(file_text(file_)); }

  void expect_rows(const nlohmann::json& all, const std::string& backend,
                   const std::set<std::size_t>& sizes, const std::set<std::string>& passes) {
    std::map<std::size_t, std::map<std::string, double>> found;
    for (const auto& row : all["cases"]) {
      EXPECT_EQ(row["backend"], backend);
      EXPECT_FALSE(row["device"].get<std::string>().empty());
      EXPECT_LE(row["median_ms"].get<double>(), row["p99_ms"].get<double>());
      if (!row["bandwidth_share"].is_null()) {
        EXPECT_GT(row["bandwidth_share"].get<double>(), 0.0) << row;
      }
      found[row["particles"]][row["pass"]] = row["median_ms"];
    }
    ASSERT_EQ(found.size(), sizes.size());
    for (const std::size_t size : sizes) {
      ASSERT_EQ(found.count(size), 1u) << size;
      ASSERT_EQ(found[size].count("step"), 1u) << size;
      for (const std::string& pass : passes) {
        ASSERT_EQ(found[size].count(pass), 1u) << pass;
        EXPECT_GT(found[size][pass], 0.0) << pass;
        EXPECT_LT(found[size][pass], 1.5 * found[size]["step"]) << pass;
      }
    }
  }

  void expect_decays(const nlohmann::json& all) {
    ASSERT_EQ(all["decay"].size(), 6u);
    std::map<std::string, std::map<int, double>> error;
    for (const auto& row : all["decay"]) {
      const int across =
          static_cast<int>(std::lround(1.0 / row["spacing_over_wavelength"].get<double>()));
      error[row["laplacian"]][across] = std::abs(row["error"].get<double>());
    }
    EXPECT_LT(error["pairwise"].at(16), 0.03);
    EXPECT_LT(error["pairwise"].at(24), error["pairwise"].at(8));
    EXPECT_GT(error["paper"].at(24), error["pairwise"].at(24));
  }

  TemporaryFolder folder_;
  fs::path file_ = folder_ / "s.json";
};

const std::set<std::string> kPasses = {"bin", "viscosity", "integrate", "collide", "splat", "gas"};

TEST_F(BenchSmoke, EveryPassAndTheStepStandBesideTheDecayError) {
  const ProgramResult result =
      run({"--backend", "cpu", "--particles", "3k,2000", "--steps", "3", "--pictures", "0",
           "--json", file_.string(), "--plot", (folder_ / "plots").string()});
  ASSERT_EQ(result.code, 0) << result.told();
  const auto all = json();
  expect_rows(all, "cpu", {2000, 3000}, kPasses);
  expect_decays(all);
  EXPECT_GT(all["memory_bytes_per_s"].get<double>(), 0.0);
  EXPECT_FALSE(all["machine"]["cpu"].get<std::string>().empty());
  EXPECT_TRUE(all["rendering"].empty());
  EXPECT_EQ(all["no_rendering"], "--pictures 0");
  for (const auto& [name, series] :
       {std::pair("smoke_time.svg", "viscosity"), std::pair("smoke_shares.svg", "viscosity"),
        std::pair("smoke_decay.svg", "pairwise")}) {
    EXPECT_NE(file_text(folder_ / "plots" / name).find(series), std::string::npos) << name;
  }
  for (const char* words : {"2k particles", "viscosity", "to reach", "1/16", "met"})
    EXPECT_NE(result.out.find(words), std::string::npos) << words << result.told();
}

TEST_F(BenchSmoke, PicturesFullOfSmokeGiveFramesASecond) {
  if (const auto context = EglContext::create(); !context) GTEST_SKIP() << context.error().text();
  const ProgramResult result = run({"--backend", "cpu", "--particles", "2k", "--steps", "2",
                                    "--pictures", "2", "--json", file_.string()});
  ASSERT_EQ(result.code, 0) << result.told();
  const auto all = json();
  ASSERT_EQ(all["rendering"].size(), 1u);
  const auto& drawn = all["rendering"][0];
  EXPECT_EQ(drawn["width"], 1280);
  EXPECT_EQ(drawn["height"], 720);
  EXPECT_EQ(drawn["quality"], "review");
  double step = 0.0;
  for (const auto& row : all["cases"])
    if (row["pass"] == "step") step = row["median_ms"];
  EXPECT_NEAR(drawn["frames_per_second"].get<double>(),
              1e3 / (step + drawn["picture_median_ms"].get<double>()), 1e-6);
}

TEST_F(BenchSmoke, TheGpusPassesAreTimedToo) {
  if (const auto context = EglContext::create(); !context) GTEST_SKIP() << context.error().text();
  const ProgramResult result = run({"--backend", "gpu", "--particles", "2k", "--steps", "2",
                                    "--pictures", "0", "--json", file_.string()});
  ASSERT_EQ(result.code, 0) << result.told();
  const auto all = json();
  expect_rows(all, "gpu", {2000}, kPasses);
  expect_decays(all);
}

TEST_F(BenchSmoke, BadSizesAreRefusedAllAtOnce) {
  expect_refused(run({"--particles", "many,12,20k"}),
                 {"--particles", "found \"many\"", "found \"12\"", "expected a whole number"});
  expect_refused(run({"--particles", "200M"}), {"--particles", "found \"200M\"", "100M"});
  expect_refused(run({"--particles", "2k", "--steps", "0"}), {"--steps", "found 0", "expected"});
  expect_refused(run({"--particles", "2k", "--pictures", "-1"}), {"--pictures", "found -1"});
}

TEST_F(BenchSmoke, OtherBadArgumentsAreRefusedBeforeAnythingIsTimed) {
  EXPECT_EQ(run({"--backend", "tpu"}).code, 2);
  EXPECT_EQ(run({"--steps", "many"}).code, 2);
  expect_refused(run({"--json", (folder_ / "none" / "s.json").string()}), {"s.json", "none"});
}

TEST_F(BenchSmoke, CtrlCStopsItAndWritesNothing) {
  ProgramCall stopped = call({"--backend", "cpu", "--particles", "20k", "--steps", "100000",
                              "--pictures", "0", "--json", file_.string()});
  stopped.interrupt_when = [](const std::string& said) {
    return said.find("smoke") != std::string::npos;
  };
  const ProgramResult result = run_program(stopped);
  ASSERT_TRUE(result.interrupted) << result.told();
  EXPECT_EQ(result.code, 130) << result.told();
  EXPECT_NE(result.err.find("stopped"), std::string::npos) << result.told();
  EXPECT_FALSE(fs::exists(file_));
}

}  // namespace
}  // namespace viscera::test
