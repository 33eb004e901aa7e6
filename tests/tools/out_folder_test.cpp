// Where a run may write, and what is there when it can't go on.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "tests/tools/tiny_scene.h"

namespace viscera::test {
namespace {

namespace fs = std::filesystem;

ProgramResult run_to(const SceneFolder& folder, const std::string& out) {
  ProgramCall call;
  call.arguments = {"run", folder.scene().string(), "--out", out, "--no-render", "--quiet"};
  call.cache = folder.cache();
  return run_program(call);
}

TEST(OutFolder, AFileInTheWayIsRefusedAndStays) {
  const SceneFolder folder;
  std::ofstream(folder.out()) << "mine";
  expect_refused(run_to(folder, folder.out().string()),
                 {"--out " + folder.out().string(), "expected a folder", "found a file"});
  EXPECT_EQ(file_text(folder.out()), "mine");
  expect_refused(run_to(folder, (folder.out() / "deeper").string()),
                 {"--out " + (folder.out() / "deeper").string(), "can't be created"});
}

TEST(OutFolder, PicturesThatNoRunHasMadeAreNotReplaced) {
  const SceneFolder folder;
  fs::create_directories(folder.out() / "frames");
  std::ofstream(folder.out() / "frames" / "0001.png") << "mine";
  expect_refused(run_to(folder, folder.out().string()), {"--out", "0001.png", "expected an empty"});
  EXPECT_EQ(file_text(folder.out() / "frames" / "0001.png"), "mine");
}

TEST(OutFolder, OneThatCantBeMadeIsRefused) {
  const SceneFolder folder;
  expect_refused(run_to(folder, "/proc/x"), {"--out /proc/x: the folder can't be created"});
  expect_refused(run_to(folder, "/proc"), {"--out /proc: files can't be written to it"});
  expect_refused(run_to(folder, ""), {"--out"});
}

TEST(OutFolder, AFileInTheWayOfASubfolderIsRefused) {
  const SceneFolder folder;
  fs::create_directories(folder.out());
  std::ofstream(folder.out() / "smoke") << "mine";
  expect_refused(folder.run({"--no-render"}), {(folder.out() / "smoke").string(), "found a file"});
}

TEST(OutFolder, AFolderInTheWayOfAFileIsNamed) {
  const SceneFolder folder;
  fs::create_directories(folder.out() / "forces.csv" / "mine");
  expect_refused(folder.run({"--no-render"}),
                 {(folder.out() / "forces.csv").string(), "can't be written"});
  expect_whole_files(folder.out());
}

TEST(OutFolder, NothingOfAnOlderRunMixesWithANewOne) {
  const SceneFolder folder;
  ASSERT_EQ(folder.run({"--no-render"}).code, 0);
  fs::create_directories(folder.out() / "frames");
  std::ofstream(folder.out() / "frames" / "0007.png") << "old";
  std::ofstream(folder.out() / "film.mp4") << "old";
  std::ofstream(folder.out() / "notes.txt") << "mine";
  const auto smoke = files_of(folder.out(), ".vdb").size();
  ASSERT_GT(smoke, 2u);
  ASSERT_EQ(folder.run({"--no-render", "--duration", "0.1"}).code, 0);
  EXPECT_LT(files_of(folder.out(), ".vdb").size(), smoke);
  EXPECT_FALSE(fs::exists(folder.out() / "frames" / "0007.png"));
  EXPECT_FALSE(fs::exists(folder.out() / "film.mp4"));
  EXPECT_EQ(file_text(folder.out() / "notes.txt"), "mine");
}

TEST(OutFolder, AMistakeLeavesTheOlderRunAsItWas) {
  const SceneFolder folder;
  ASSERT_EQ(folder.run({"--no-render"}).code, 0);
  const std::string report = file_text(folder.out() / "report.json");
  const auto smoke = files_of(folder.out(), ".vdb");
  expect_refused(folder.run({"--no-render", "--set", "instruments/hook/path/0/tip_mm=[0,0,10]"}),
                 {"starts"});
  EXPECT_EQ(file_text(folder.out() / "report.json"), report);
  EXPECT_EQ(files_of(folder.out(), ".vdb"), smoke);
}

TEST(OutFolder, ASecondRunIntoItIsRefusedAndTouchesNothing) {
  Json scene = tiny_scene();
  scene["duration_s"] = 600;
  const SceneFolder folder(scene);
  ProgramCall first = folder.call({"--no-render"});
  std::erase(first.arguments, "--quiet");
  ProgramResult second;
  const fs::path volume = folder.out() / "smoke" / "0005.vdb";
  first.interrupt_when = [&](const std::string&) {
    if (!fs::exists(volume)) return false;
    const std::string before = file_text(volume);
    second = run_to(folder, folder.out().string());
    EXPECT_EQ(file_text(volume), before);
    return true;
  };
  const ProgramResult stopped = run_program(first);
  ASSERT_TRUE(stopped.interrupted) << stopped.told();
  EXPECT_EQ(stopped.code, 130) << stopped.told();
  expect_refused(second, {"--out " + folder.out().string(), "found another run", "expected"});
  EXPECT_LT(second.wall_s, 60.0) << "it waited for the first";
  EXPECT_GT(folder.report()["frames"], 11);
  expect_whole_files(folder.out());
  ASSERT_EQ(folder.run({"--no-render", "--duration", "0.1"}).code, 0) << "it is free again";
}

TEST(OutFolder, ADiskWithoutAnyRoomIsNamedAndNothingBegins) {
  const SceneFolder folder;
  ProgramCall call = folder.call({"--no-render", "--no-cache"});
  call.greatest_file = 0;
  expect_refused(run_program(call), {folder.out().string(), "File too large"});
  EXPECT_FALSE(fs::exists(folder.out() / "report.json"));
  expect_whole_files(folder.out());
}

class FullDisk : public testing::TestWithParam<std::size_t> {};

TEST_P(FullDisk, IsNamedAndLeavesWholeFilesOnly) {
  const SceneFolder folder;
  // Prepared before, so that what fails is an output and not the cache.
  ASSERT_EQ(folder.run({"--no-render"}).code, 0);
  fs::remove_all(folder.out());
  ProgramCall call = folder.call({"--no-render"});
  call.greatest_file = GetParam();
  expect_failed(run_program(call), 1, {folder.out().string(), "File too large"});
  expect_whole_files(folder.out());
  EXPECT_TRUE(fs::exists(folder.out() / "forces.csv"));
  if (GetParam() < 12000) {
    EXPECT_FALSE(fs::exists(folder.out() / "report.json")) << "not even that fits";
    return;
  }
  const Json report = folder.report();
  EXPECT_EQ(report["complete"], false);
  EXPECT_NE(report["reason"].get<std::string>().find("File too large"), std::string::npos);
}

INSTANTIATE_TEST_SUITE_P(Bytes, FullDisk, testing::Values(700, 5000, 12000),
                         [](const auto& bytes) { return std::to_string(bytes.param); });

}  // namespace
}  // namespace viscera::test
