// Ctrl-C at any time: exit code 130, and files that are whole or absent.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>

#include "tests/tools/tiny_scene.h"

namespace viscera::test {
namespace {

/// Says its progress, and is interrupted once it has said `word`.
ProgramResult run_until(const SceneFolder& folder, const std::string& word,
                        const std::vector<std::string>& options) {
  ProgramCall call = folder.call(options);
  std::erase(call.arguments, "--quiet");
  call.interrupt_when = [word](const std::string& err) {
    return err.find(word) != std::string::npos;
  };
  return run_program(call);
}

TEST(Interrupt, DuringPreparationLeavesNoCacheFile) {
  const SceneFolder folder(slow_scene());
  const ProgramResult result = run_until(folder, "factoring", {"--no-render"});
  ASSERT_TRUE(result.interrupted) << result.told();
  EXPECT_EQ(result.code, 130) << result.told();
  EXPECT_NE(result.err.find("stopped"), std::string::npos);
  EXPECT_TRUE(files_of(folder.cache(), ".h5").empty());
  EXPECT_TRUE(files_of(folder.cache(), ".tmp").empty());
  EXPECT_TRUE(files_of(folder.out(), ".json").empty());
  expect_whole_files(folder.out());
}

TEST(Interrupt, DuringSimulationKeepsWhatWasSimulated) {
  Json scene = tiny_scene();
  scene["duration_s"] = 600;
  const SceneFolder folder(scene);
  const ProgramResult result = run_until(folder, "simulating", {"--no-render"});
  ASSERT_TRUE(result.interrupted) << result.told();
  EXPECT_EQ(result.code, 130) << result.told();
  const Json report = folder.report();
  EXPECT_EQ(report["complete"], false);
  EXPECT_LT(report["frames"], 36000);
  expect_whole_files(folder.out());
  const std::string table = file_text(folder.out() / "forces.csv");
  EXPECT_EQ(std::count(table.begin(), table.end(), '\n'), report["frames"].get<long>() + 1);
  // The organ was prepared to its end, and its cache is good.
  EXPECT_EQ(files_of(folder.cache(), ".h5").size(), 1u);
  EXPECT_EQ(run_until(folder, "simulating", {"--no-render"}).code, 130);
  EXPECT_EQ(folder.report()["organs"][0]["cache_hit"], true);
}

TEST(Interrupt, ARunThatHasTimeEnoughIsComplete) {
  const SceneFolder folder(tiny_scene());
  const ProgramResult result = folder.run({"--no-render", "--time-limit", "3600"});
  EXPECT_EQ(result.code, 0) << result.told();
  EXPECT_EQ(folder.report()["complete"], true);
}

TEST(Interrupt, ARunWhoseTimeIsUpLeavesWhatWasSimulatedAndSaysSo) {
  Json scene = tiny_scene();
  scene["duration_s"] = 600;
  const SceneFolder folder(scene);
  EXPECT_EQ(folder.run({"--no-render", "--duration", "0.1"}).code, 0);  // prepared
  const ProgramResult result =
      folder.run({"--no-render", "--time-limit", "1", "--checkpoint", "60"});
  EXPECT_EQ(result.code, 142) << result.told();
  const Json report = folder.report();
  EXPECT_EQ(report["complete"], false);
  EXPECT_NE(report["reason"].get<std::string>().find("its time was up"), std::string::npos);
  EXPECT_GT(report["frames"], 0);
  EXPECT_LT(report["frames"], 36000);
  expect_whole_files(folder.out());
}

TEST(Interrupt, APreparationWhoseTimeIsUpLeavesNothing) {
  const SceneFolder folder(slow_scene());
  const ProgramResult result = folder.run({"--no-render", "--time-limit", "0.5"});
  EXPECT_EQ(result.code, 142) << result.told();
  EXPECT_TRUE(files_of(folder.cache(), ".h5").empty());
  expect_whole_files(folder.out());
}

}  // namespace
}  // namespace viscera::test
