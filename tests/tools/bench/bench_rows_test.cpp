// What benchmarks say of figures: met only where all that should count in one was measured.
#include <gtest/gtest.h>

#include <limits>
#include <nlohmann/json.hpp>
#include <sstream>

#include "tools/bench/bench_hemisphere_rows.h"
#include "tools/common/bench_figures.h"

namespace viscera {
namespace {

std::string printed(const std::vector<BenchRow>& rows) {
  std::ostringstream out;
  print_rows(rows, "bench", out);
  return out.str();
}

TEST(BenchRows, AreMetWithinTheirTarget) {
  EXPECT_TRUE((BenchRow{"time", "s", 0.9, 1.0}).met());
  EXPECT_FALSE((BenchRow{"time", "s", 1.1, 1.0}).met());
  EXPECT_TRUE((BenchRow{"speed", "x", 1.1, 1.0, true}).met());
  EXPECT_FALSE((BenchRow{"error", "%", std::numeric_limits<double>::quiet_NaN(), 1.0}).met());
}

TEST(BenchRows, WithoutAValueArentMetAndSayWhy) {
  const BenchRow row{"memory", "GB", std::nullopt, 4.0, false, {"it ended with exit code 137"}};
  EXPECT_FALSE(row.met());
  const std::string text = printed({row, {"time", "s", 0.9, 1.0}});
  for (const char* words :
       {"NOT MEASURED", "dropped: it ended with exit code 137", "1 of 2 met, 1 wholly measured"})
    EXPECT_NE(text.find(words), std::string::npos) << text;
  const auto json = to_json({row});
  EXPECT_TRUE(json[0]["value"].is_null());
  EXPECT_FALSE(json[0]["met"]);
  EXPECT_EQ(json[0]["dropped"][0], "it ended with exit code 137");
}

TEST(BenchRows, WithADroppedCaseArentMetHoweverGoodTheOthersAre) {
  WorstCase worst;
  worst.add(-0.01, "a .1");
  worst.add(std::nullopt, "a .3: contact without a solution");
  const BenchRow row = worst.row("reaction", "%", 3.0, 100.0);
  EXPECT_NEAR(*row.value, 1.0, 1e-12);
  EXPECT_FALSE(row.met());
  const std::string text = printed({row});
  EXPECT_NE(text.find("NOT MET: cases were dropped"), std::string::npos) << text;
  EXPECT_NE(text.find("dropped: a .3: contact without a solution"), std::string::npos) << text;
}

TEST(BenchRows, ACaseThatIsNoNumberIsDropped) {
  WorstCase worst;
  worst.add(std::numeric_limits<double>::quiet_NaN(), "nu .45");
  EXPECT_FALSE(worst.row("reaction", "%", 3.0).value);
  EXPECT_EQ(worst.row("reaction", "%", 3.0).dropped.size(), 1u);
}

TEST(BenchRows, AllAreMetOnlyTogether) {
  EXPECT_NE(printed({{"a", "s", 1.0, 2.0}, {"b", "s", 1.0, 2.0}}).find("all 2 met"),
            std::string::npos);
  EXPECT_NE(printed({{"a", "s", 1.0, 2.0}, {"b", "s", 3.0, 2.0}}).find("1 of 2 met"),
            std::string::npos);
}

HemisphereCase solved(const std::string& contact, double a, double force_error) {
  HemisphereCase one;
  one.formulation = "galerkin";
  one.nodes = 1080;
  one.poisson = 0.3;
  one.a_over_R = a;
  one.contact = contact;
  if (contact != "press") one.force_error = force_error;
  one.profile_error = 0.01;
  return one;
}

const BenchRow& named(const std::vector<BenchRow>& rows, const std::string& words) {
  for (const BenchRow& row : rows)
    if (row.what.find(words) != std::string::npos) return row;
  ADD_FAILURE() << words;
  return rows.front();
}

TEST(HemisphereRows, DropAContactWithoutASolutionFromTheirWorst) {
  std::vector<HemisphereCase> cases = {solved("stick", 0.1, 0.01), solved("press", 0.1, 0.0)};
  const auto whole = hemisphere_error_rows(cases, {});
  EXPECT_TRUE(named(whole, "reaction, stick").met());
  cases.push_back(solved("stick", 0.2, 0.0));
  cases.back().force_error.reset();
  cases.back().profile_error.reset();
  cases.back().note = "contact without a solution";
  const auto rows = hemisphere_error_rows(cases, {});
  const BenchRow& reaction = named(rows, "reaction, stick");
  EXPECT_NEAR(*reaction.value, 1.0, 1e-12);
  EXPECT_FALSE(reaction.met());
  ASSERT_EQ(reaction.dropped.size(), 1u);
  EXPECT_NE(reaction.dropped[0].find("a 0.20 R, stick: contact without a solution"),
            std::string::npos);
  // A smooth pressure has no reaction: nothing is missing.
  EXPECT_TRUE(named(rows, "pressure profile").met());
}

TEST(HemisphereRows, DropBodiesThatWereRefused) {
  const auto rows = hemisphere_error_rows({solved("stick", 0.1, 0.01)},
                                          {{"galerkin", 0.45, kNodesToReach, "too near"}});
  EXPECT_FALSE(named(rows, "reaction, stick").met());
  EXPECT_EQ(named(rows, "reaction, stick").dropped.size(), 2u);  // stick and frictionless
  // Other numbers of nodes have no target.
  EXPECT_TRUE(named(hemisphere_error_rows({solved("stick", 0.1, 0.01)},
                                          {{"galerkin", 0.45, 4400, "too near"}}),
                    "reaction, stick")
                  .met());
}

}  // namespace
}  // namespace viscera
