#include "engine/io/trace.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "tests/engine/io/file_text.h"
#include "tests/support/paths.h"

namespace viscera {
namespace {

using std::chrono::microseconds;
using test::file_text;
using test::TemporaryFolder;

TEST(Quantiles, FollowTheNearestRank) {
  std::vector<double> values;
  for (int i = 200; i >= 1; --i) values.push_back(i);
  const Quantiles q = quantiles(values);
  EXPECT_EQ(q.count, 200u);
  EXPECT_EQ(q.median, 100.0);
  EXPECT_EQ(q.p99, 198.0);
  EXPECT_EQ(q.max, 200.0);
  EXPECT_EQ(q.total, 20100.0);
}

TEST(Quantiles, OfOneValueAreThatValueAndOfNoneZero) {
  const Quantiles one = quantiles({3.0});
  EXPECT_EQ(one.median, 3.0);
  EXPECT_EQ(one.p99, 3.0);
  EXPECT_EQ(quantiles({}).count, 0u);
  EXPECT_EQ(quantiles({}).max, 0.0);
}

TEST(Trace, KeepsTheStagesApart) {
  Trace trace({"contacts", "deform"});
  const auto start = Trace::Clock::now();
  trace.add(0, 0, start, start + microseconds(10));
  trace.add(1, 0, start, start + microseconds(400));
  trace.add(0, 1, start, start + microseconds(30));
  EXPECT_NEAR(trace.durations(0).total, 40e-6, 1e-12);
  EXPECT_NEAR(trace.durations(0).median, 10e-6, 1e-12);
  EXPECT_EQ(trace.durations(1).count, 1u);
}

TEST(Trace, TimesAScope) {
  Trace trace({"deform"});
  { const StageTimer timer(trace, 0, 5); }
  EXPECT_EQ(trace.size(), 1u);
  EXPECT_GE(trace.durations(0).max, 0.0);
}

TEST(Trace, WritesChromesFormat) {
  const TemporaryFolder folder;
  Trace trace({"find \"contacts\"", "deform"});
  const auto start = Trace::Clock::now();
  trace.add(0, 41, start, start + std::chrono::nanoseconds(1500));
  trace.add(1, 42, start + microseconds(2), start + microseconds(5));
  ASSERT_TRUE(trace.write(folder / "profile.json", "viscera"));

  const auto json = nlohmann::json::parse(file_text(folder / "profile.json"));
  std::vector<nlohmann::json> complete;
  for (const auto& event : json.at("traceEvents")) {
    if (event.at("ph") == "X") complete.push_back(event);
  }
  ASSERT_EQ(complete.size(), 2u);
  EXPECT_EQ(complete[0].at("name"), "find \"contacts\"");
  EXPECT_EQ(complete[0].at("dur"), 1.5);
  EXPECT_EQ(complete[0].at("args").at("frame"), 41);
  EXPECT_EQ(complete[1].at("dur"), 3.0);
  EXPECT_NEAR(complete[1].at("ts").get<double>() - complete[0].at("ts").get<double>(), 2.0, 1e-3);
  for (const auto& event : complete) {
    EXPECT_TRUE(event.contains("pid") && event.contains("tid"));
  }
}

TEST(Trace, OfNothingIsStillValid) {
  const TemporaryFolder folder;
  ASSERT_TRUE(Trace({"deform"}).write(folder / "profile.json", "viscera"));
  EXPECT_TRUE(nlohmann::json::accept(file_text(folder / "profile.json")));
  EXPECT_FALSE(Trace({"deform"}).write(folder / "missing/profile.json", "viscera"));
}

TEST(Trace, GoesOnAfterEventsOfAnEarlierProcess) {
  Trace trace({"one", "two"});
  ASSERT_TRUE(trace.restore({{.stage = 1, .frame = 3, .start = 10000, .duration = 500}}));
  const auto now = Trace::Clock::now();
  trace.add(0, 4, now, now + microseconds(3));
  ASSERT_EQ(trace.size(), 2u);
  EXPECT_GE(trace.events()[1].start, 10500);
  EXPECT_FALSE(trace.restore({{.stage = 2, .frame = 3, .start = 0, .duration = 1}}));
  EXPECT_EQ(trace.size(), 2u);
}

}  // namespace
}  // namespace viscera
