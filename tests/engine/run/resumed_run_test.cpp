// What observers have made when a run was killed and went on is what they make of a run in one go.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <map>
#include <string>

#include "engine/gpu/egl_context.h"
#include "engine/simulator/checkpoint_file.h"
#include "tests/engine/io/file_text.h"
#include "tests/engine/run/watched_run.h"
#include "tests/support/paths.h"

namespace viscera::test {
namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t kFrames = 24;

std::map<std::string, std::string> files_in(const fs::path& folder) {
  std::map<std::string, std::string> files;
  for (const auto& entry : fs::recursive_directory_iterator(folder))
    if (entry.is_regular_file())
      files[fs::relative(entry.path(), folder).string()] = file_text(entry.path());
  return files;
}

/// A hash of each picture that a player shows.
std::string decoded(const fs::path& film) {
  std::string text;
  const std::string command = "ffmpeg -v error -i '" + film.string() + "' -f framemd5 - 2>&1";
  std::FILE* pipe = popen(command.c_str(), "r");
  char part[4096];
  while (const std::size_t got = std::fread(part, 1, sizeof part, pipe)) text.append(part, got);
  pclose(pipe);
  return text;
}

struct Outcome {
  std::map<std::string, std::string> files;
  std::string report, pictures;
};

Outcome outcome_of(WatchedRun& run, const fs::path& folder, bool pictures) {
  Outcome outcome;
  const auto report = run.end();
  EXPECT_TRUE(report) << report.error().text();
  if (!report) return outcome;
  outcome.report = to_json(*report);
  if (pictures) outcome.pictures = decoded(folder / "film.mp4");
  outcome.files = files_in(folder);
  return outcome;
}

Outcome in_one_go(const SceneDescription& scene, bool pictures) {
  const TemporaryFolder folder;
  WatchedRun run(scene, folder.path(), pictures, 0);
  EXPECT_TRUE(run.begin());
  const Result<void> stepped = run.step_to(kFrames);
  EXPECT_TRUE(stepped) << stepped.error().text();
  return outcome_of(run, folder.path(), pictures);
}

/// Stopped at `last`, when the last checkpoint was of `kept`: by a kill, or so that files were
/// still ended, as after Ctrl-C.
Outcome in_two_goes(const SceneDescription& scene, bool pictures, std::uint64_t kept,
                    std::uint64_t last, bool ended) {
  const TemporaryFolder folder, store;
  {
    WatchedRun run(scene, folder.path(), pictures, 0);
    EXPECT_TRUE(run.begin());
    EXPECT_TRUE(run.step_to(kept));
    const auto checkpoint = run.save();
    EXPECT_TRUE(checkpoint) << checkpoint.error().text();
    EXPECT_TRUE(write_checkpoint(store / "checkpoint.bin", *checkpoint));
    EXPECT_TRUE(run.step_to(last));
    if (ended) {
      EXPECT_TRUE(run.end());
    }
  }
  WatchedRun run(scene, folder.path(), pictures, kept);
  const auto checkpoint = read_checkpoint(store / "checkpoint.bin", {});
  EXPECT_TRUE(checkpoint) << checkpoint.error().text();
  const Result<void> gone_on = run.go_on(*checkpoint);
  EXPECT_TRUE(gone_on) << gone_on.error().text();
  const Result<void> stepped = run.step_to(kFrames);
  EXPECT_TRUE(stepped) << stepped.error().text();
  return outcome_of(run, folder.path(), pictures);
}

void expect_same(const Outcome& one, const Outcome& other) {
  EXPECT_EQ(one.report, other.report);
  EXPECT_EQ(one.pictures, other.pictures);
  for (const auto& [name, text] : one.files) {
    ASSERT_TRUE(other.files.contains(name)) << name;
    // An encoder may write the same pictures in other bytes, and the page holds the film.
    if (name == "film.mp4" || (name == "review.html" && one.files.contains("film.mp4"))) continue;
    EXPECT_TRUE(text == other.files.at(name)) << name;
  }
  for (const auto& [name, text] : other.files) EXPECT_TRUE(one.files.contains(name)) << name;
}

TEST(ResumedRun, HasTheFilesAndTheReportOfOneInOneGo) {
  const SceneDescription scene = watched_scene();
  const Outcome whole = in_one_go(scene, false);
  for (const char* name : {"forces.csv", "lesion.csv", "vtk/organs.pvd", "smoke/0011.vdb",
                           "review.html", "lesion.svg"})
    EXPECT_TRUE(whole.files.contains(name)) << name << ": nothing to compare";
  for (const std::uint64_t kept : {0u, 3u, 11u, 20u})
    for (const bool ended : {false, true}) {
      SCOPED_TRACE(std::to_string(kept) + (ended ? ", stopped" : ", killed"));
      expect_same(whole, in_two_goes(scene, false, kept, std::min(kept + 5, kFrames), ended));
    }
}

TEST(ResumedRun, HasTheFramesPassesAndDecodedPicturesOfOneInOneGo) {
  if (const auto context = EglContext::create(); !context) GTEST_SKIP() << context.error().text();
  const SceneDescription scene = watched_scene();
  const Outcome whole = in_one_go(scene, true);
  for (const char* name : {"film.mp4", "frames/0011.png", "passes/0011.exr"})
    EXPECT_TRUE(whole.files.contains(name)) << name << ": nothing to compare";
  EXPECT_NE(whole.pictures.find("0,         11,"), std::string::npos) << whole.pictures;
  for (const bool ended : {false, true})
    expect_same(whole, in_two_goes(scene, true, 11, 16, ended));
}

TEST(ResumedRun, IsRefusedWithOtherObserversThanItBegan) {
  const SceneDescription scene = watched_scene();
  const TemporaryFolder folder;
  WatchedRun run(scene, folder.path(), false, 0);
  ASSERT_TRUE(run.begin());
  auto checkpoint = run.save();
  ASSERT_TRUE(checkpoint);
  Checkpoint more = *checkpoint, less = *checkpoint;
  more.parts.push_back({"frames", {}});
  std::erase_if(less.parts, [](const CheckpointPart& part) { return part.name == "surfaces"; });
  const auto says = [](const Result<void>& refused, const std::string& what) {
    return !refused && refused.error().text().find(what) != std::string::npos;
  };
  EXPECT_TRUE(says(run.go_on(more), "found a part \"frames\", expected none"));
  EXPECT_TRUE(says(run.go_on(less), "found no part \"surfaces\", expected one"));
}

TEST(ResumedRun, IsRefusedWithAPartThatIsCutOffOrOfAnotherScene) {
  const SceneDescription scene = watched_scene();
  const TemporaryFolder folder;
  WatchedRun run(scene, folder.path(), false, 0);
  ASSERT_TRUE(run.begin());
  ASSERT_TRUE(run.step_to(14));
  const auto checkpoint = run.save();
  ASSERT_TRUE(checkpoint);
  for (const CheckpointPart& part : checkpoint->parts) {
    if (part.bytes.empty()) continue;
    Checkpoint cut = *checkpoint;
    for (CheckpointPart& one : cut.parts)
      if (one.name == part.name) one.bytes.pop_back();
    const Result<void> refused = run.go_on(cut);
    ASSERT_FALSE(refused) << part.name;
    EXPECT_NE(refused.error().text().find("its part \"" + part.name + "\""), std::string::npos);
  }
  SceneDescription other = scene;
  other.instruments.push_back(other.instruments[0]);
  other.instruments[1].name = "second";
  other.instruments[1].path = {{0.0, Vec3(0.1, 0, 0.1), 0.0, 1.0}};
  WatchedRun foreign(other, folder.path(), false, 0);
  EXPECT_FALSE(foreign.go_on(*checkpoint));
}

}  // namespace
}  // namespace viscera::test
