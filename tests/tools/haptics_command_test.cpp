// `viscera haptics`, on the wall clock: that it ends, reports and writes; how fast is for benchmarks.
#include <gtest/gtest.h>

#include "tests/tools/tiny_scene.h"

namespace viscera::test {
namespace {

Json held_scene() {
  Json scene = tiny_scene();
  scene["instruments"][0]["haptic"] = {{"grip", "firm"}};
  return scene;
}

ProgramResult haptics(const SceneFolder& folder, std::vector<std::string> more) {
  std::vector<std::string> words{"haptics", folder.scene().string()};
  words.insert(words.end(), more.begin(), more.end());
  return run_program({.arguments = words, .cache = folder.cache()});
}

TEST(HapticsCommand, ReportsTicksLatenessAndComputingTime) {
  const SceneFolder folder(held_scene());
  const ProgramResult result =
      haptics(folder, {"--seconds", "1.5", "--no-render", "--json", (folder / "h.json").string(),
                       "--plot", (folder / "plots").string(), "--record",
                       (folder / "hand.csv").string()});
  ASSERT_EQ(result.code, 0) << result.told();
  const Json json = Json::parse(file_text(folder / "h.json"));
  EXPECT_GT(json["ticks"].get<int>() + json["missed"].get<int>(), 1400);
  for (const char* name : {"lateness_us", "compute_us"})
    for (const char* share : {"p50", "p99", "p999", "max"})
      EXPECT_TRUE(json[name][share].is_number()) << name << share;
  EXPECT_TRUE(json["scheduler"].is_string());
  EXPECT_TRUE(json["energy_J"].is_number());
  EXPECT_TRUE(json["passivity_violations"].is_number());
  EXPECT_EQ(json["tools"].size(), 1u);
  EXPECT_TRUE(std::filesystem::exists(folder / "plots/latency_hook.svg"));
  expect_whole_files(folder / "plots");

  const ProgramResult replayed =
      haptics(folder, {"--seconds", "0.5", "--no-render", "--device", "recorded", "--recording",
                       (folder / "hand.csv").string()});
  EXPECT_EQ(replayed.code, 0) << replayed.told();
}

TEST(HapticsCommand, BadInputIsRefusedBeforeAnythingStarts) {
  const SceneFolder plain;
  expect_refused(haptics(plain, {"--seconds", "1"}), {"instruments", "expected one that is held"});
  const SceneFolder folder(held_scene());
  expect_refused(haptics(folder, {"--seconds", "-1"}), {"--seconds", "-1"});
  expect_refused(haptics(folder, {"--device", "recorded"}), {"--recording"});
  expect_refused(haptics(folder, {"--device", "recorded", "--recording", "nowhere.csv"}),
                 {"nowhere.csv"});
  expect_refused(haptics(folder, {"--device", "omega"}), {"--device"});
  expect_refused(haptics(folder, {"--json", "/nowhere/h.json"}), {"/nowhere"});
}

TEST(HapticsCommand, CtrlCEndsItAndStillReports) {
  const SceneFolder folder(held_scene());
  ProgramCall call{.arguments = {"haptics", folder.scene().string(), "--seconds", "60",
                                 "--no-render"},
                   .cache = folder.cache()};
  call.interrupt_when = [](const std::string& err) {
    return err.find("in touch") != std::string::npos;
  };
  const ProgramResult result = run_program(call);
  EXPECT_TRUE(result.interrupted);
  EXPECT_LT(result.wall_s, 50.0);
  EXPECT_NE(result.out.find("ticks"), std::string::npos) << result.told();
}

}  // namespace
}  // namespace viscera::test
