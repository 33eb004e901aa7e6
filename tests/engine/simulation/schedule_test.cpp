#include "engine/simulation/schedule.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <sstream>

#include "engine/simulator/build.h"
#include "tests/support/paths.h"

namespace viscera {
namespace {

using testing::HasSubstr;

void nothing(World&, const FrameContext&) {}

Feature feature(std::string_view name, std::vector<Stage> stages) {
  Feature made;
  made.name = name;
  for (Stage& stage : stages) stage.run = nothing;
  made.stages = std::move(stages);
  return made;
}

std::vector<std::string> order(const Schedule& schedule) {
  std::vector<std::string> names;
  for (const Stage& stage : schedule.stages()) names.emplace_back(stage.name);
  return names;
}

TEST(Schedule, PutsWhoReadsAfterWhoWritesAndWhoChangesBetweenThem) {
  const auto schedule = Schedule::of({
      feature("a", {{.name = "draw", .reads = {"shape"}}}),
      feature("b", {{.name = "bend", .reads = {"shape"}, .writes = {"shape"}}}),
      feature("c", {{.name = "make", .writes = {"shape"}}}),
      feature("d", {{.name = "remember", .reads_before = {"shape"}}}),
  });
  ASSERT_TRUE(schedule) << schedule.error().text();
  EXPECT_EQ(order(*schedule), (std::vector<std::string>{"remember", "make", "bend", "draw"}));
}

TEST(Schedule, KeepsTheListsOrderWhereNothingElseDecides) {
  const auto schedule = Schedule::of({
      feature("a", {{.name = "first", .writes = {"x"}}}),
      feature("b", {{.name = "second", .writes = {"x"}}}),
      feature("c", {{.name = "third", .writes = {"y"}}}),
  });
  ASSERT_TRUE(schedule);
  EXPECT_EQ(order(*schedule), (std::vector<std::string>{"first", "second", "third"}));
}

TEST(Schedule, RefusesStagesThatWaitForEachOther) {
  const auto schedule = Schedule::of({
      feature("a", {{.name = "hen", .reads = {"egg"}, .writes = {"hen"}}}),
      feature("b", {{.name = "egg", .reads = {"hen"}, .writes = {"egg"}}}),
  });
  ASSERT_FALSE(schedule);
  EXPECT_THAT(schedule.error().text(), HasSubstr("\"hen\", \"egg\""));
}

TEST(Schedule, RefusesAStageThatReadsWhatNobodyWrites) {
  const auto schedule = Schedule::of({feature("a", {{.name = "draw", .reads = {"shpae"}}})});
  ASSERT_FALSE(schedule);
  EXPECT_THAT(schedule.error().text(), HasSubstr("shpae"));
}

TEST(Schedule, OfTheSimulatorIsTheStepThatArchitectureTells) {
  // Others may come between them.
  const std::vector<std::string> backbone = {
      "read tools",     "run servos",    "move organs", "find contacts", "shape organs",
      "tie organs",     "deform organs", "heat tissue", "emit smoke",    "move smoke",
      "fetch surfaces", "publish",       "check"};
  std::vector<std::string> found;
  for (const std::string& stage : order(step_schedule()))
    if (std::find(backbone.begin(), backbone.end(), stage) != backbone.end())
      found.push_back(stage);
  EXPECT_EQ(found, backbone);
  std::ifstream file(test::project_file("ARCHITECTURE.md"));
  std::stringstream text;
  text << file.rdbuf();
  EXPECT_THAT(text.str(), HasSubstr(step_schedule().markdown()))
      << "ARCHITECTURE.md lacks this table, which Schedule::markdown() makes:\n"
      << step_schedule().markdown();
}

}  // namespace
}  // namespace viscera
