#include <gtest/gtest.h>
#include <sys/wait.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <string>

#include "engine/gpu/egl_context.h"
#include "tests/support/paths.h"

namespace viscera {
namespace {

namespace fs = std::filesystem;

class GpuBench : public testing::Test {
 protected:
  /// Exit code; what it said is in text().
  int run(const std::string& command) const {
    const int status =
        std::system((command + " > '" + (folder_ / "said").string() + "' 2>&1").c_str());
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  }
  int bench(const std::string& arguments) const {
    return run(std::string("'") + VISCERA_GPU_BENCH + "' " + arguments);
  }
  std::string text() const { return test::file_text(folder_ / "said"); }

  const test::TemporaryFolder folder_;
};

TEST_F(GpuBench, SpeedsStandBesideErrorsAndTheMachinesOwnBandwidth) {
  if (const auto context = EglContext::create(); !context) GTEST_SKIP() << context.error().text();
  const fs::path json = folder_ / "g.json";
  ASSERT_EQ(bench("--places 300 --vertices 700 --touchable 20 --touched 6 --organs 1,3 --repeats 3 "
                  "--window-mb 8 --json '" +
                  json.string() + "'"),
            0)
      << text();
  const auto report = nlohmann::json::parse(std::ifstream(json));
  EXPECT_FALSE(report["device"].get<std::string>().empty());
  EXPECT_GT(report["memory"]["read_bytes_per_s"].get<double>(), 0.0);
  ASSERT_EQ(report["cases"].size(), 2u);
  EXPECT_EQ(report["cases"][1]["organs"], 3);
  for (const auto& row : report["cases"]) {
    // Round-off of single precision; positions of some centimetres.
    EXPECT_LT(row["error"]["displacement"].get<double>(), 1e-5);
    EXPECT_LT(row["error"]["position_m"].get<double>(), 1e-7);
    EXPECT_LT(row["error"]["normal_rad"].get<double>(), 1e-3);
    EXPECT_GT(row["gpu"]["product"]["median_us"].get<double>(), 0.0);
    EXPECT_GT(row["cpu"]["product_us"].get<double>(), 0.0);
    EXPECT_NEAR(row["share_of_read"].get<double>(),
                row["product_bytes_per_s"].get<double>() / row["read_bytes_per_s"].get<double>(),
                1e-9);
  }
  EXPECT_NE(text().find("device: " + report["device"].get<std::string>()), std::string::npos);
}

TEST_F(GpuBench, HalfPrecisionReadsHalfAsMuch) {
  if (const auto context = EglContext::create(); !context) GTEST_SKIP() << context.error().text();
  const fs::path json = folder_ / "g.json";
  ASSERT_EQ(bench("--half --places 300 --vertices 300 --touchable 20 --touched 6 --organs 1 "
                  "--repeats 1 --window-mb 8 --json '" +
                  json.string() + "'"),
            0)
      << text();
  const auto row = nlohmann::json::parse(std::ifstream(json))["cases"][0];
  EXPECT_EQ(row["storage"], "half");
  EXPECT_EQ(row["product_bytes"], 3 * row["places"].get<int>() * (18 * 2 + 4));
  EXPECT_LT(row["error"]["displacement"].get<double>(), 1e-5);
}

TEST_F(GpuBench, ImpossibleNumbersAreRefused) {
  EXPECT_EQ(bench("--touched 30 --touchable 20"), 2);
  EXPECT_NE(text().find("--touched 30 --touchable 20"), std::string::npos) << text();
  EXPECT_EQ(bench("--organs 0"), 2);
  EXPECT_EQ(bench("--places many"), 2);
  EXPECT_EQ(bench("--unknown"), 2);
}

TEST_F(GpuBench, FileThatCantBeWrittenIsNamed) {
  if (const auto context = EglContext::create(); !context) GTEST_SKIP() << context.error().text();
  EXPECT_EQ(bench("--places 100 --vertices 100 --touchable 8 --touched 4 --organs 1 --repeats 1 "
                  "--window-mb 1 --json '" +
                  (folder_ / "none" / "g.json").string() + "'"),
            2);
  EXPECT_NE(text().find("g.json: can't be written"), std::string::npos) << text();
}

TEST_F(GpuBench, NeedsNoLibraryOfScenesVolumesOrCaches) {
  if (run("ldd --version") != 0) GTEST_SKIP() << "no ldd";
  ASSERT_EQ(run(std::string("ldd '") + VISCERA_GPU_BENCH + "'"), 0);
  EXPECT_NE(text().find("libepoxy"), std::string::npos);
  for (const char* heavy : {"embree", "openvdb", "hdf5", "assimp", "mumps"}) {
    EXPECT_EQ(text().find(heavy), std::string::npos) << text();
  }
}

TEST_F(GpuBench, SmokesPassesAreTimedBesideTheErrorOfTheDecay) {
  if (const auto context = EglContext::create(); !context) GTEST_SKIP() << context.error().text();
  const fs::path json = folder_ / "s.json";
  ASSERT_EQ(
      bench("smoke --particles 300,2k --repeats 2 --window-mb 8 --json '" + json.string() + "'"), 0)
      << text();
  const auto report = nlohmann::json::parse(std::ifstream(json));
  std::map<int, std::set<std::string>> passes;
  for (const auto& row : report["cases"]) {
    EXPECT_EQ(row["backend"], "gpu");
    EXPECT_EQ(row["device"], report["device"]);
    EXPECT_GT(row["median_ms"].get<double>(), 0.0);
    EXPECT_GE(row["p99_ms"].get<double>(), row["median_ms"].get<double>());
    passes[row["particles"].get<int>()].insert(row["pass"].get<std::string>());
  }
  ASSERT_EQ(passes.size(), 2u);
  for (const char* pass : {"bin", "viscosity", "integrate", "collide", "splat", "step"}) {
    EXPECT_TRUE(passes[300].contains(pass)) << pass;
    EXPECT_TRUE(passes[2000].contains(pass)) << pass;
  }
  ASSERT_EQ(report["decay"].size(), 4u);
  for (const auto& row : report["decay"]) {
    if (row["laplacian"] == "pairwise" && row["spacing_over_wavelength"] == 1.0 / 16) {
      EXPECT_LT(std::abs(row["error"].get<double>()), 0.03);
    }
  }
}

TEST_F(GpuBench, HeatsPassesAreTimedBesideTheirDifferenceFromTheCpu) {
  if (const auto context = EglContext::create(); !context) GTEST_SKIP() << context.error().text();
  const fs::path json = folder_ / "h.json";
  ASSERT_EQ(bench("heat --bricks 1,2 --repeats 2 --window-mb 8 --json '" + json.string() + "'"), 0)
      << text();
  const auto report = nlohmann::json::parse(std::ifstream(json));
  std::map<int, std::set<std::string>> passes;
  for (const auto& row : report["cases"]) {
    const std::string pass = row["pass"];
    passes[row["voxels"].get<int>()].insert(pass);
    EXPECT_EQ(row["backend"], pass == "step on the CPU" ? "cpu" : "gpu");
    EXPECT_GT(row["median_ms"].get<double>(), 0.0);
    EXPECT_GE(row["p99_ms"].get<double>(), row["median_ms"].get<double>());
  }
  ASSERT_EQ(passes.size(), 2u);
  for (const auto& [voxels, names] : passes)
    for (const char* pass : {"upload", "rates", "advance", "settle", "read back",
                             "step, fields back", "step, fields stay", "step on the CPU"})
      EXPECT_TRUE(names.contains(pass)) << voxels << ' ' << pass;
  ASSERT_EQ(report["differences"].size(), 2u);
  for (const auto& row : report["differences"]) {
    EXPECT_TRUE(row["same_bricks"].get<bool>());
    EXPECT_LT(row["excess"].get<double>(), 1e-4);
    EXPECT_LT(row["damage"].get<double>(), 1e-3);
  }
  EXPECT_LT(report["edge_error"].get<double>(), 0.02);
  EXPECT_EQ(bench("heat --bricks 0"), 2);
}

TEST_F(GpuBench, NumbersOfParticlesThatAreNoneAreRefusedAllAtOnce) {
  EXPECT_EQ(bench("smoke --particles 10q,5k,0"), 2);
  for (const char* part : {"--particles", "10q", "\"0\"", "expected a number from 1 to 100M"})
    EXPECT_NE(text().find(part), std::string::npos) << text();
}

}  // namespace
}  // namespace viscera
