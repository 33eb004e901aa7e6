// `viscera profile` from end to end.
#include <gtest/gtest.h>

#include <set>

#include "engine/gpu/egl_context.h"
#include "kernels/base/sanitized.h"
#include "tests/tools/tiny_scene.h"

namespace viscera::test {
namespace {

ProgramCall profile(const SceneFolder& folder, const std::vector<std::string>& more) {
  ProgramCall call;
  call.arguments = {"profile", folder.scene().string()};
  call.arguments.insert(call.arguments.end(), more.begin(), more.end());
  call.cache = folder.cache();
  return call;
}

std::set<std::string> stages_of(const Json& profile, int organs, int touched) {
  std::set<std::string> stages;
  for (const Json& one : profile["cases"]) {
    if (one["organs"] != organs || one["touched"] != touched) continue;
    stages.insert(one["stage"]);
    EXPECT_GT(one["median_us"], 0.0) << one;
    EXPECT_LE(one["median_us"], one["p99_us"]) << one;
    EXPECT_LE(one["p99_us"], one["max_us"]) << one;
  }
  return stages;
}

TEST(ProfileCommand, MeasuresEveryNumberOfOrgansTouchedAndIdle) {
  const SceneFolder folder;
  const ProgramResult result = run_program(
      profile(folder, {"--organs", "4,1,2,2", "--json", (folder / "p.json").string(), "--plot",
                       (folder / "plots").string(), "--trace", (folder / "t.json").string()}));
  ASSERT_EQ(result.code, 0) << result.told();
  const Json all = Json::parse(file_text(folder / "p.json"));
  EXPECT_EQ(all["scene"], "tiny");
  EXPECT_FALSE(all["machine"].get<std::string>().empty());
  for (const int organs : {1, 2, 4})
    for (const int touched : {0, 1}) {
      const auto stages = stages_of(all, organs, touched);
      for (const char* stage : {"read tools", "find contacts", "deform organs", "check", "step"})
        EXPECT_TRUE(stages.contains(stage)) << organs << ' ' << touched << ' ' << stage;
      EXPECT_FALSE(stages.contains("draw"));
    }
  EXPECT_TRUE(all["idle_organ_us"].is_number());
  EXPECT_GT(all["touched_organ_us"], 0.0);
  ASSERT_EQ(all["memory"].size(), 3u);
  EXPECT_EQ(all["memory"][2]["organs"], 4);
  EXPECT_GT(all["memory"][0]["bytes"], 0);
  if (!kSanitized)
    EXPECT_LT(all["memory"][2]["bytes"].get<double>() - all["memory"][1]["bytes"].get<double>(),
              2e6);
  for (const char* word : {"over real time", "an idle organ", "a touched organ", "to reach"})
    EXPECT_NE(result.out.find(word), std::string::npos) << word << result.told();
  for (const char* plot : {"plots/cost_against_organs.svg", "plots/memory_against_organs.svg"})
    EXPECT_NE(file_text(folder / plot).find("<path"), std::string::npos) << plot;
  const Json trace = Json::parse(file_text(folder / "t.json"));
  std::set<std::string> names;
  for (const Json& event : trace["traceEvents"]) names.insert(event["name"]);
  for (const char* stage : {"step", "find contacts", "deform organs"})
    EXPECT_TRUE(names.contains(stage)) << stage;
}

TEST(ProfileCommand, TimesThePassesOfPicturesOnTheirDevice) {
  if (const auto context = EglContext::create(); !context) GTEST_SKIP() << context.error().text();
  const SceneFolder folder;
  const ProgramResult result =
      run_program(profile(folder, {"--organs", "2", "--seconds", "0.1", "--render", "--json",
                                   (folder / "p.json").string()}));
  ASSERT_EQ(result.code, 0) << result.told();
  const Json all = Json::parse(file_text(folder / "p.json"));
  EXPECT_FALSE(all["renderer"].get<std::string>().empty());
  const auto stages = stages_of(all, 2, 1);
  for (const char* stage : {"draw", "draw: depth", "draw: organs", "draw: develop"})
    EXPECT_TRUE(stages.contains(stage)) << stage;
  // One number of organs has no slope.
  EXPECT_TRUE(all["idle_organ_us"].is_null());
}

TEST(ProfileCommand, WithoutTouchedOrgansNeedsNoInstruments) {
  Json scene = tiny_scene();
  scene["instruments"] = Json::array();
  const SceneFolder folder(scene);
  const ProgramResult result = run_program(
      profile(folder, {"--organs", "1,2", "--touched", "0", "--seconds", "0.1", "--json",
                       (folder / "p.json").string(), "--plot", (folder / "plots").string()}));
  ASSERT_EQ(result.code, 0) << result.told();
  const Json all = Json::parse(file_text(folder / "p.json"));
  EXPECT_TRUE(all["touched_organ_us"].is_null());
}

struct WrongProfile {
  const char* name;
  std::vector<std::string> options;
  std::vector<std::string> words;
};

class BadProfile : public testing::TestWithParam<WrongProfile> {};

TEST_P(BadProfile, IsRefused) {
  const SceneFolder folder;
  expect_refused(run_program(profile(folder, GetParam().options)), GetParam().words);
}

INSTANTIATE_TEST_SUITE_P(
    Profile, BadProfile,
    testing::Values(
        WrongProfile{"NoOrgan", {"--organs", "0"}, {"--organs: found 0, expected from 1"}},
        WrongProfile{"NegativeOrgans", {"--organs", "4,-2"}, {"--organs: found -2, expected"}},
        WrongProfile{"Absurd", {"--organs", "1,1000000"}, {"--organs: found 1000000, expected"}},
        WrongProfile{"InWords", {"--organs", "many"}, {"--organs", "many"}},
        WrongProfile{"TouchedAboveOrgans",
                     {"--organs", "8,2", "--touched", "3"},
                     {"--touched: found 3, expected", "2"}},
        WrongProfile{"NegativeTouched", {"--touched", "-1"}, {"--touched: found -1, expected"}},
        WrongProfile{"NoTime", {"--seconds", "0"}, {"--seconds: found 0, expected"}},
        WrongProfile{"EndlessTime", {"--seconds", "inf"}, {"--seconds: found inf, expected"}},
        WrongProfile{"NowhereToWrite", {"--json", "/nowhere/p.json"}, {"/nowhere/p.json"}}),
    [](const auto& wrong) { return std::string(wrong.param.name); });

TEST(BadProfile, ScenesWithoutOrgansToolsOrCameraAreRefusedWithAllReasons) {
  Json scene = tiny_scene();
  scene["organs"] = Json::array();
  scene["instruments"] = Json::array();
  scene.erase("camera");
  const SceneFolder folder(scene);
  expect_refused(run_program(profile(folder, {"--render"})),
                 {"organs: found none, expected", "instruments: found none, expected",
                  "camera: found none, expected"});
}

TEST(BadProfile, ToolsThatTouchTooFewOrgansAreRefused) {
  Json scene = tiny_scene();
  for (Json& tool : scene["instruments"])
    for (Json& key : tool["path"]) key["tip_mm"][2] = 40;
  const SceneFolder folder(scene);
  expect_refused(run_program(profile(folder, {"--organs", "1"})),
                 {"--touched: found 1, but", "touch 0 of its 1 organs, expected at most"});
}

TEST(ProfileCommand, EndsCleanlyOnCtrlC) {
  Json scene = tiny_scene();
  scene["duration_s"] = 600;
  const SceneFolder folder(scene);
  ProgramCall call = profile(folder, {"--json", (folder / "p.json").string()});
  call.interrupt_when = [](const std::string& err) {
    return err.find("profiling") != std::string::npos;
  };
  const ProgramResult result = run_program(call);
  ASSERT_TRUE(result.interrupted) << result.told();
  EXPECT_EQ(result.code, 130) << result.told();
  EXPECT_NE(result.err.find("stopped"), std::string::npos);
  EXPECT_FALSE(std::filesystem::exists(folder / "p.json"));
}

}  // namespace
}  // namespace viscera::test
