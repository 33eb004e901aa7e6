// The benchmarks of the elastic core, from end to end at small sizes.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "tests/support/paths.h"
#include "tests/support/program.h"

namespace viscera::test {
namespace fs = std::filesystem;
namespace {

class Bench : public testing::Test {
 protected:
  ProgramResult run(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), "bench");
    ProgramCall call;
    call.arguments = std::move(arguments);
    call.cache = folder_ / "cache";
    return run_program(call);
  }
  nlohmann::json json(const fs::path& file) { return nlohmann::json::parse(file_text(file)); }

  TemporaryFolder folder_;
};

TEST_F(Bench, HemisphereRunsANamedCaseAndComparesItWithTheReference) {
  const fs::path file = folder_ / "h.json";
  const ProgramResult result = run({"hemisphere", "--quick", "--nodes", "300", "--a", "0.2",
                                    "--poisson", "0.3", "--formulation", "galerkin", "--json",
                                    file.string(), "--plot", (folder_ / "plots").string()});
  ASSERT_EQ(result.code, 0) << result.told();
  const auto all = json(file);
  ASSERT_EQ(all["cases"].size(), 3u);
  for (const auto& one : all["cases"]) {
    EXPECT_EQ(one["formulation"], "galerkin");
    EXPECT_EQ(one["basis"], "linear");
    EXPECT_LE(one["nodes"].get<int>(), 300);
    EXPECT_LT(one["surface_nodes"].get<int>(), one["nodes"].get<int>());
    for (const char* key : {"prepare_s", "assemble_s", "factor_s", "compliance_s", "online_us"}) {
      EXPECT_GT(one[key].get<double>(), 0.0) << key;
    }
    EXPECT_GT(one["memory_bytes"].get<double>(), 0.0);
    // Far coarser than what is to reach 4 %.
    EXPECT_LT(one["profile_error"].get<double>(), 0.2);
    if (one["contact"] == "press") {
      EXPECT_TRUE(one["force_error"].is_null());
      continue;
    }
    EXPECT_LT(std::abs(one["force_error"].get<double>()), 0.15);
    const double reference = one["contact"] == "stick" ? 0.522829 : 0.492322;
    EXPECT_NEAR(one["force_over_ERdelta"].get<double>() / reference - 1.0,
                one["force_error"].get<double>(), 1e-6);
    EXPECT_GT(one["smallest_eigenvalue"].get<double>(), 0.0);
  }
}

TEST_F(Bench, HemisphereWithoutAReferenceHasForcesButNoErrors) {
  const fs::path file = folder_ / "h.json";
  const ProgramResult result =
      run({"hemisphere", "--quick", "--nodes", "300", "--a", "0.15", "--poisson", "0.4",
           "--formulation", "galerkin", "--contact", "stick", "--json", file.string()});
  ASSERT_EQ(result.code, 0) << result.told();
  const auto all = json(file);
  ASSERT_EQ(all["cases"].size(), 1u);
  const auto& one = all["cases"][0];
  // Between the references of the neighbouring radii.
  EXPECT_GT(one["force_over_ERdelta"].get<double>(), 0.242311);
  EXPECT_LT(one["force_over_ERdelta"].get<double>(), 0.589663);
  EXPECT_TRUE(one["force_error"].is_null());
  EXPECT_TRUE(one["profile_error"].is_null());
  EXPECT_LT(std::abs(one["own_reference"]["force_error"].get<double>()), 0.15);
}

TEST_F(Bench, ConvergenceGivesErrorsAndOrders) {
  const fs::path file = folder_ / "c.json";
  const ProgramResult result = run({"convergence", "--quick", "--formulation", "galerkin", "--json",
                                    file.string(), "--plot", (folder_ / "plots").string()});
  ASSERT_EQ(result.code, 0) << result.told();
  const auto all = json(file);
  ASSERT_EQ(all["cases"].size(), 6u);
  for (const auto& one : all["cases"]) {
    EXPECT_EQ(one["jitter"], 0.2);
    EXPECT_LT(one["error"].get<double>(), 0.02);
    if (one["nodes"] == 512) {
      EXPECT_TRUE(one["order"].is_null());
    } else {
      EXPECT_GT(one["order"].get<double>(), 1.7);
    }
  }
  EXPECT_TRUE(fs::exists(folder_ / "plots/convergence_nu0.45.svg"));
}

TEST_F(Bench, ZWidthGivesTheGreatestStableStiffnessWithAndWithoutTheController) {
  const fs::path file = folder_ / "z.json";
  const ProgramResult result = run({"zwidth", "--grip", "0,1", "--damping", "0,2", "--json",
                                    file.string(), "--plot", (folder_ / "plots").string()});
  ASSERT_EQ(result.code, 0) << result.told();
  const auto all = json(file);
  ASSERT_EQ(all["cases"].size(), 8u);
  const double shown = all["default_coupling"]["stiffness_N_per_m"];
  double loose[2] = {0.0, 0.0};  // undamped, without and with the controller
  for (const auto& one : all["cases"]) {
    const double stiffness = one["greatest_stable_N_per_m"];
    const bool controller = one["passivity_controller"];
    if (one["damping_Ns_per_m"] == 2.0 && controller) {
      EXPECT_GT(stiffness, 2.0 * shown) << one;
    }
    if (one["damping_Ns_per_m"] == 0.0 && one["grip"] == 0.0) loose[controller] = stiffness;
  }
  EXPECT_GT(loose[0], 100.0);
  EXPECT_GT(loose[1], loose[0]);
  EXPECT_TRUE(fs::exists(folder_ / "plots/zwidth.svg"));
  const ProgramResult refused = run({"zwidth", "--grip", "1.5", "--damping", "-1"});
  EXPECT_EQ(refused.code, 2) << refused.told();
  for (const char* word : {"--grip", "1.5", "--damping", "-1"})
    EXPECT_NE(refused.err.find(word), std::string::npos) << word << refused.told();
}

TEST_F(Bench, BodiesGiveTimeAgainstErrorAndSayHowMuchTheBodyDecides) {
  const fs::path file = folder_ / "b.json";
  const ProgramResult result =
      run({"bodies", "--body", "slab_2,sphere_0.4", "--nodes", "300", "--poisson", "0.3", "--json",
           file.string(), "--plot", (folder_ / "plots").string()});
  ASSERT_EQ(result.code, 0) << result.told();
  const auto all = json(file);
  ASSERT_EQ(all["cases"].size(), 4u);
  for (const auto& one : all["cases"]) {
    EXPECT_LE(one["nodes"].get<int>(), 300);
    EXPECT_GT(one["prepare_s"].get<double>(), 0.0);
    EXPECT_LT(one["profile_error"].get<double>(), 0.3) << one;
    const std::string load = one["load"];
    if (load == "flat" || load == "ball") {
      EXPECT_EQ(one["prepares"], "all loads");
      EXPECT_LT(std::abs(one["force_error"].get<double>()), 0.3) << one;
      EXPECT_GT(one["force_over_half_space"].get<double>(), 1.5);
      EXPECT_GT(one["online_us"].get<double>(), 0.0);
    } else {
      EXPECT_TRUE(one["force_error"].is_null());
      EXPECT_TRUE(load == "press" || one["prepares"] == "this load");
    }
  }
  // Too few nodes for the figures to reach.
  EXPECT_TRUE(all["rows"].empty());
  EXPECT_EQ(run({"bodies", "--body", "slab_2", "--nodes", "300", "--poisson", "0.3",
                 "--formulation", "paper"})
                .code,
            0);
}

TEST_F(Bench, BodiesRefuseWhatHasNoReference) {
  const ProgramResult result = run(
      {"bodies", "--body", "cone", "--poisson", "0.4", "--nodes", "3", "--formulation", "springs"});
  EXPECT_EQ(result.code, 2) << result.told();
  for (const char* word : {"cone", "slab_3.5", "0.4", "0.49", "--nodes", "springs"})
    EXPECT_NE(result.err.find(word), std::string::npos) << word << result.told();
}

TEST_F(Bench, RefusesWhatItCantRunWithAllReasons) {
  const ProgramResult result =
      run({"hemisphere", "--formulation", "springs", "--poisson", "0.5", "--a", "0.7"});
  EXPECT_EQ(result.code, 2) << result.told();
  for (const char* word : {"springs", "galerkin", "0.5", "--a"})
    EXPECT_NE(result.err.find(word), std::string::npos) << word << result.told();
  EXPECT_EQ(run({"hemisphere", "--contact", "glue"}).code, 2);
  EXPECT_EQ(run({"convergence", "--formulation", "springs"}).code, 2);
}

}  // namespace
}  // namespace viscera::test
