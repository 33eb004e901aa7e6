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
  if (!kSanitized) {
    EXPECT_LT(all["memory"][2]["bytes"].get<double>() - all["memory"][1]["bytes"].get<double>(),
              2e6);
  }
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

TEST(ProfileCommand, LeavesOutCasesWithFewerOrgansThanAreToBeTouched) {
  const SceneFolder folder;
  const ProgramResult result = run_program(profile(
      folder, {"--organs", "1,2,3", "--touched", "2", "--json", (folder / "p.json").string()}));
  // The tiny scene has one organ, which every berth holds.
  ASSERT_EQ(result.code, 0) << result.told();
  const Json all = Json::parse(file_text(folder / "p.json"));
  EXPECT_EQ(all["left_out"], Json::array({"1 organs with 2 touched"}));
  EXPECT_NE(result.out.find("left out: 1 organs with 2 touched"), std::string::npos);
  EXPECT_TRUE(stages_of(all, 1, 2).empty());
  EXPECT_FALSE(stages_of(all, 1, 0).empty());
  EXPECT_FALSE(stages_of(all, 2, 2).empty());
  EXPECT_GT(all["touched_organ_us"], 0.0);
}

TEST(ProfileCommand, PlacesMoreThanAThousandOrgans) {
  const SceneFolder folder;
  const ProgramResult result =
      run_program(profile(folder, {"--organs", "1200", "--touched", "0", "--seconds", "0.05",
                                   "--json", (folder / "p.json").string()}));
  ASSERT_EQ(result.code, 0) << result.told();
  EXPECT_FALSE(stages_of(Json::parse(file_text(folder / "p.json")), 1200, 0).empty());
}

/// A ball beside one that breathes upwards and draws it along by a link.
Json drawn_ball() {
  Json scene = tiny_scene();
  Json carrier = scene["organs"][0];
  carrier["name"] = "carrier";
  carrier["pose"] = {{"position_mm", {30, 0, 0}}};
  carrier["deformable"] = false;
  carrier["motion"] = {{"amplitude_mm", 8}, {"period_s", 0.4}, {"direction", {0, 0, 1}}};
  scene["organs"].push_back(carrier);
  scene["links"] =
      Json::array({{{"name", "ligament"},
                    {"between", {"ball", "carrier"}},
                    {"region", {{"sphere", {{"centre_mm", {15, 0, 0}}, {"radius_mm", 9}}}}},
                    {"stiffness_N_per_m", 1000}}});
  return scene;
}

TEST(ProfileCommand, TouchesAnOrganThatToolsTouchNotOneThatOnlyLinksHold) {
  // The first of the scene's organs is held by a link all the time; the probe presses the third.
  Json scene = drawn_ball();
  Json pressed = scene["organs"][0];
  pressed["name"] = "pressed";
  pressed["pose"] = {{"position_mm", {0, 100, 0}}};
  scene["organs"].push_back(pressed);
  scene["instruments"].erase(1);
  for (Json& key : scene["instruments"][0]["path"]) key["tip_mm"][1] = 100;
  const SceneFolder folder(scene);
  const ProgramResult result =
      run_program(profile(folder, {"--organs", "1", "--json", (folder / "p.json").string()}));
  ASSERT_EQ(result.code, 0) << result.told();
  const Json all = Json::parse(file_text(folder / "p.json"));
  EXPECT_GT(all["touched_organ_us"], 0.0) << result.told();
  EXPECT_TRUE(all["not_touched"].is_null());
}

TEST(ProfileCommand, SaysWhenAnOrganIsMetOnlyBecauseItsLinksDrawItToTheTool) {
  Json scene = drawn_ball();
  Json& probe = scene["instruments"][0];
  probe["kind"] = "probe";
  probe["path"] = Json::array({{{"time_s", 0.0}, {"tip_mm", {12.2, 0, 12.2}}}});
  scene["instruments"].erase(1);
  const SceneFolder folder(scene);
  const ProgramResult result =
      run_program(profile(folder, {"--organs", "1", "--json", (folder / "p.json").string()}));
  ASSERT_EQ(result.code, 0) << result.told();
  const Json all = Json::parse(file_text(folder / "p.json"));
  EXPECT_TRUE(all["touched_organ_us"].is_null());
  const std::string reason = all["not_touched"].is_null() ? "" : all["not_touched"];
  EXPECT_NE(reason.find("without its neighbours and links ball isn't met"), std::string::npos);
  EXPECT_NE(result.out.find(reason), std::string::npos);
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
        WrongProfile{"NoOrgan", {"--organs", "0"}, {"--organs: found 0, expected 1 or more"}},
        WrongProfile{"NegativeOrgans", {"--organs", "4,-2"}, {"--organs: found -2, expected"}},
        WrongProfile{"MoreOrgansThanMemoryHolds",
                     {"--organs", "1,1000000000", "--seconds", "0.1", "--touched", "0"},
                     {"--organs: found 1000000000 organs that need", "GB beside", "name fewer"}},
        WrongProfile{"InWords", {"--organs", "many"}, {"--organs", "many"}},
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
