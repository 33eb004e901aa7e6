#include "engine/io/report_section.h"

#include <gtest/gtest.h>

#include <limits>
#include <nlohmann/json.hpp>

namespace viscera {
namespace {

using Json = nlohmann::ordered_json;

Json merged(const char* all, const char* more) {
  Json value = Json::parse(all);
  merge_section(value, Json::parse(more));
  return value;
}

TEST(ReportSection, OfObjectsHasTheKeysOfBothInTheFirstOnesOrder) {
  EXPECT_EQ(merged(R"({"a": 1, "b": 2})", R"({"c": 3, "a": 4})").dump(), R"({"a":4,"b":2,"c":3})");
}

TEST(ReportSection, JoinsEntriesThatBeginAlikeAndKeepsOthers) {
  EXPECT_EQ(merged(R"([{"organ": "liver", "kg": 1}, {"organ": "lung", "kg": 2}])",
                   R"([{"organ": "lung", "factor": 3}, {"organ": "spleen", "factor": 4}])")
                .dump(),
            R"([{"organ":"liver","kg":1},{"organ":"lung","kg":2,"factor":3},)"
            R"({"organ":"spleen","factor":4}])");
}

TEST(ReportSection, NullReplacesNothingAndIsReplaced) {
  EXPECT_EQ(merged(R"({"a": 1, "b": null})", R"({"a": null, "b": 2, "c": null})").dump(),
            R"({"a":1,"b":2,"c":null})");
  EXPECT_EQ(merged("null", R"({"a": 1})").dump(), R"({"a":1})");
}

TEST(ReportSection, KeepsTheBitsOfNumbersAndMendsText) {
  const ReportSection section = report_section(
      "x",
      {{"third", 1.0 / 3.0}, {"none", std::numeric_limits<double>::infinity()}, {"name", "\xff"}});
  const Json value = Json::parse(section.json);
  EXPECT_EQ(value["third"].get<double>(), 1.0 / 3.0);
  EXPECT_TRUE(value["none"].is_null());
  EXPECT_TRUE(value["name"].is_string());
}

}  // namespace
}  // namespace viscera
