#include "engine/run/run_folder.h"

#include <gtest/gtest.h>
#include <signal.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <filesystem>
#include <string>
#include <vector>

#include "kernels/base/stopwatch.h"
#include "tests/engine/io/file_text.h"
#include "tests/support/paths.h"

namespace viscera {
namespace {

namespace fs = std::filesystem;
using test::file_text;
using test::put_text;
using test::TemporaryFolder;

TEST(RunFolder, IsOneRunsAtATimeAndTheSecondTouchesNothing) {
  const TemporaryFolder folder;
  auto first = RunFolder::take(folder.path());
  ASSERT_TRUE(first) << first.error().text();
  first->clear();
  fs::create_directories(folder / "frames");
  put_text(folder / "frames/0000.png", "the first run's");
  put_text(folder / "forces.csv", "the first run's");
  const Stopwatch watch;
  const auto second = RunFolder::take(folder.path());
  EXPECT_LT(watch.seconds(), 1.0);
  ASSERT_FALSE(second);
  for (const char* part : {"--out", "found another run", "expected"})
    EXPECT_NE(second.error().text().find(part), std::string::npos) << second.error().text();
  EXPECT_NE(second.error().text().find(folder.path().string()), std::string::npos);
  EXPECT_EQ(file_text(folder / "frames/0000.png"), "the first run's");
  EXPECT_EQ(file_text(folder / "forces.csv"), "the first run's");
  EXPECT_FALSE(RunFolder::take(folder.path())) << "a refusal doesn't let go of the first one's";
}

TEST(RunFolder, IsFreeAgainWhenTheRunHasEnded) {
  const TemporaryFolder folder;
  {
    auto first = RunFolder::take(folder.path());
    ASSERT_TRUE(first);
    first->clear();
    RunFolder moved = *std::move(first);
    EXPECT_FALSE(RunFolder::take(folder.path()));
  }
  EXPECT_TRUE(RunFolder::take(folder.path()));
}

TEST(RunFolder, IsFreeAgainWhenTheProcessWasKilled) {
  const TemporaryFolder folder;
  int ready[2];
  ASSERT_EQ(pipe(ready), 0);
  const pid_t child = fork();
  if (child == 0) {
    auto held = RunFolder::take(folder.path());
    if (held) held->clear();
    const char said = held ? 'y' : 'n';
    if (::write(ready[1], &said, 1) != 1) _exit(1);
    while (true) pause();
  }
  char said = 0;
  ASSERT_EQ(::read(ready[0], &said, 1), 1);
  EXPECT_EQ(said, 'y');
  EXPECT_FALSE(RunFolder::take(folder.path()));
  kill(child, SIGKILL);
  waitpid(child, nullptr, 0);
  EXPECT_TRUE(RunFolder::take(folder.path()));
  close(ready[0]);
  close(ready[1]);
}

TEST(RunFolder, OneThatNeverBeganLeavesTheFolderAsItWas) {
  const TemporaryFolder folder;
  { EXPECT_TRUE(RunFolder::take(folder.path())); }
  EXPECT_EQ(test::entries(folder.path()), 0);
  put_text(folder / "forces.csv", "mine");
  const auto refused = RunFolder::take(folder.path());
  ASSERT_FALSE(refused);
  EXPECT_NE(refused.error().text().find("forces.csv, which no run"), std::string::npos);
  EXPECT_EQ(test::entries(folder.path()), 1);
}

TEST(RunFolder, WhatAKillHasCutOffGoesAndNothingElse) {
  const TemporaryFolder folder;
  fs::create_directories(folder / "vtk/liver");
  for (const char* name : {"forces.csv.123-4.tmp", "vtk/liver/0001.vtu.9-12.tmp"})
    put_text(folder / name, "half");
  const std::vector<const char*> others = {"mine.tmp", "a.b-c.tmp", "forces.csv.123-4", ".tmp"};
  for (const char* name : others) put_text(folder / name, "mine");
  auto run = RunFolder::take(folder.path());
  ASSERT_TRUE(run) << run.error().text();
  EXPECT_TRUE(fs::exists(folder / "forces.csv.123-4.tmp")) << "it hasn't begun yet";
  run->keep();
  EXPECT_FALSE(fs::exists(folder / "forces.csv.123-4.tmp"));
  EXPECT_FALSE(fs::exists(folder / "vtk/liver/0001.vtu.9-12.tmp"));
  for (const char* name : others) EXPECT_EQ(file_text(folder / name), "mine") << name;
}

/// Bytes on the disk that this process holds by files of the folder which have no name any more.
std::uintmax_t nameless_bytes(const fs::path& folder) {
  const std::string begins = fs::canonical(folder).string() + "/";
  std::uintmax_t bytes = 0;
  for (const fs::directory_entry& open : fs::directory_iterator("/proc/self/fd")) {
    std::error_code gone;
    const std::string file = fs::read_symlink(open.path(), gone).string();
    struct stat status = {};
    if (file.starts_with(begins) && file.ends_with(" (deleted)") &&
        ::stat(open.path().c_str(), &status) == 0)
      bytes += 512 * static_cast<std::uintmax_t>(status.st_blocks);
  }
  return bytes;
}

TEST(RunFolder, TheRoomThatItKeepsGoesWithItAndIsNeverSeen) {
  constexpr std::uintmax_t kForFiles = 4 << 20, kForReport = 256 << 10;
  const TemporaryFolder folder;
  auto run = RunFolder::take(folder.path());
  ASSERT_TRUE(run);
  const auto reserved = run->reserve();
  ASSERT_TRUE(reserved) << reserved.error().text();
  EXPECT_EQ(test::entries(folder.path()), 1) << "the marker";
  EXPECT_GE(nameless_bytes(folder.path()), kForFiles + kForReport);
  run->release(RunFolder::Room::kFiles);
  EXPECT_GE(nameless_bytes(folder.path()), kForReport);
  EXPECT_LT(nameless_bytes(folder.path()), kForFiles);
  run->release(RunFolder::Room::kFiles);
  RunFolder moved = *std::move(run);
  EXPECT_GE(nameless_bytes(folder.path()), kForReport);
  moved.release(RunFolder::Room::kReport);
  EXPECT_EQ(nameless_bytes(folder.path()), 0u);
  EXPECT_TRUE(moved.sync());
}

TEST(RunFolder, AnOlderRunStaysUntilThisOneBeginsAndWhenItGoesOn) {
  const TemporaryFolder folder;
  {
    auto older = RunFolder::take(folder.path());
    ASSERT_TRUE(older);
    older->clear();
  }
  put_text(folder / "forces.csv", "older");
  put_text(folder / kCheckpointName, "older");
  put_text(folder / "notes.txt", "mine");
  {
    auto going_on = RunFolder::take(folder.path());
    ASSERT_TRUE(going_on);
    going_on->keep();
  }
  EXPECT_EQ(file_text(folder / "forces.csv"), "older");
  auto later = RunFolder::take(folder.path());
  ASSERT_TRUE(later);
  EXPECT_EQ(file_text(folder / "forces.csv"), "older");
  later->clear();
  EXPECT_FALSE(fs::exists(folder / "forces.csv"));
  EXPECT_FALSE(fs::exists(folder / kCheckpointName));
  EXPECT_EQ(file_text(folder / "notes.txt"), "mine");
}

}  // namespace
}  // namespace viscera
