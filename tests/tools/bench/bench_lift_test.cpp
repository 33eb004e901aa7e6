// Of `viscera bench lift`: the cases with references of others, and what it says and refuses.
#include "tools/bench/bench_lift.h"

#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "tests/support/paths.h"

namespace viscera::test {
namespace {

using Json = nlohmann::json;

Json bench(std::vector<std::string> names) {
  const TemporaryFolder folder;
  LiftBenchOptions options;
  options.cases = std::move(names);
  options.json = folder / "lift.json";
  std::ostringstream out;
  const auto done = bench_lift(options, out);
  EXPECT_TRUE(done) << done.error().text();
  return Json::parse(std::ifstream(options.json));
}

const Json& find(const Json& cases, const std::string& name, const std::string& response) {
  for (const Json& one : cases)
    if (one["case"] == name && one["response"] == response) return one;
  throw std::runtime_error("no case " + name + ", " + response);
}

TEST(BenchLift, ABentBlockHasTheForceOfFiniteElementsWithinOnePercentAndALinearOneHasNot) {
  const Json cases = bench({"block"})["cases"];
  const Json &finite = find(cases, "block", "finite"), &linear = find(cases, "block", "linear");
  EXPECT_LT(finite["force_error_p90"].get<double>(), 0.01);
  EXPECT_LT(finite["shape_error_m"].get<double>(), 1e-3);
  EXPECT_GT(linear["force_error_p90"].get<double>(), 0.5);
  EXPECT_GT(finite["nodes"], 900);
  EXPECT_LT(finite["nodes"], 1200);
}

TEST(BenchLift, ASlenderBarUnderADeadLoadComesToWhereTheElasticaDoesWithinTwoPercent) {
  const Json all = bench({"elastica_1", "elastica_2"});
  ASSERT_EQ(all["rows"].size(), 4u);
  for (const Json& row : all["rows"]) EXPECT_LT(row["value"].get<double>(), 2.0) << row["what"];
  for (const char* name : {"elastica_1", "elastica_2"}) {
    const Json& one = find(all["cases"], name, "finite");
    EXPECT_LT(one["force_error_p90"].get<double>(), 0.02);
    EXPECT_TRUE(one["frame_ms"].is_null());
  }
}

TEST(BenchLift, UnknownCasesAndSenselessIterationsAreRefusedTogether) {
  LiftBenchOptions options;
  options.cases = {"sausage"};
  options.iterations = {0};
  std::ostringstream out;
  const auto done = bench_lift(options, out);
  ASSERT_FALSE(done);
  ASSERT_EQ(done.error().messages.size(), 2u);
  EXPECT_NE(done.error().messages[0].find("found \"sausage\", expected gallbladder, "),
            std::string::npos);
  EXPECT_EQ(done.error().messages[1], "--iterations: found 0, expected 1 to 40");
}

}  // namespace
}  // namespace viscera::test
