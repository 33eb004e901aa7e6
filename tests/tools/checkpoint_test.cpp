// Runs that are killed and go on, and runs that are recorded and replayed.
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <thread>

#include "tests/tools/tiny_scene.h"

namespace viscera::test {
namespace {

namespace fs = std::filesystem;

/// The tiny scene for so long that it can be stopped in the middle, and ends all the same.
Json longer_scene(double seconds = 3.0) {
  Json scene = tiny_scene();
  scene["duration_s"] = seconds;
  return scene;
}

/// For a run that is only to be met: it doesn't end before, however late that is.
Json endless_scene() {
  return longer_scene(600.0);
}

const std::vector<std::string> kNoPictures = {"--no-render"};

std::vector<std::string> with(std::vector<std::string> words,
                              const std::vector<std::string>& more) {
  words.insert(words.end(), more.begin(), more.end());
  return words;
}

/// Starts a run and kills it as soon as `ready` says so; false where it ended before.
bool run_killed(const SceneFolder& folder, const std::vector<std::string>& more,
                const std::function<bool()>& ready) {
  const ProgramCall call = folder.call(more);
  const pid_t child = fork();
  if (child == 0) {
    setenv("VISCERA_CACHE", call.cache.c_str(), 1);
    std::vector<std::string> words = call.arguments;
    words.insert(words.begin(), VISCERA_PROGRAM);
    std::vector<char*> all;
    for (std::string& word : words) all.push_back(word.data());
    all.push_back(nullptr);
    execv(VISCERA_PROGRAM, all.data());
    _exit(127);
  }
  int status = 0;
  while (waitpid(child, &status, WNOHANG) == 0) {
    if (ready()) {
      kill(child, SIGKILL);
      waitpid(child, &status, 0);
      return WIFSIGNALED(status);
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  return false;
}

TEST(Checkpoint, OfARunThatWasKilledThreeTimesLeadsToTheSameFiles) {
  const SceneFolder whole(longer_scene());
  const ProgramResult once = whole.run(kNoPictures);
  ASSERT_EQ(once.code, 0) << once.told();

  const SceneFolder folder(longer_scene());
  const fs::path checkpoint = folder.out() / "checkpoint.bin";
  std::vector<std::string> words = with(kNoPictures, {"--checkpoint", "0.1"});
  int kills = 0;
  for (int round = 0; round < 3; ++round) {
    const auto before =
        fs::exists(checkpoint) ? fs::last_write_time(checkpoint) : fs::file_time_type::min();
    const bool killed = run_killed(folder, words, [&] {
      return fs::exists(checkpoint) && fs::last_write_time(checkpoint) > before;
    });
    if (!killed) break;
    ++kills;
    words = with(kNoPictures, {"--checkpoint", "0.1", "--resume"});
  }
  EXPECT_GE(kills, 1);
  const ProgramResult last = folder.run(words);
  ASSERT_EQ(last.code, 0) << last.told();
  EXPECT_EQ(whole.report()["state_hash"], folder.report()["state_hash"]);
  EXPECT_EQ(file_text(whole.out() / "forces.csv"), file_text(folder.out() / "forces.csv"));
  const auto volumes = files_of(whole.out(), ".vdb");
  EXPECT_EQ(volumes.size(), files_of(folder.out(), ".vdb").size());
  for (const fs::path& volume : volumes)
    EXPECT_EQ(file_text(volume), file_text(folder.out() / fs::relative(volume, whole.out())));
  EXPECT_FALSE(fs::exists(checkpoint)) << "a whole run needs none";
  expect_whole_files(folder.out());
}

TEST(Checkpoint, GoesOnAfterCtrlC) {
  const Json scene = longer_scene(6.0);
  const SceneFolder whole(scene), folder(scene);
  ASSERT_EQ(whole.run(kNoPictures).code, 0);
  ProgramCall call = folder.call(with(kNoPictures, {"--checkpoint", "1000"}));
  const fs::path first = folder.out() / "smoke" / "0000.vdb";
  call.interrupt_when = [first](const std::string&) { return fs::exists(first); };
  const ProgramResult stopped = run_program(call);
  ASSERT_EQ(stopped.code, 130) << stopped.told();
  const ProgramResult last = folder.run(with(kNoPictures, {"--checkpoint", "1000", "--resume"}));
  ASSERT_EQ(last.code, 0) << last.told();
  EXPECT_EQ(whole.report()["state_hash"], folder.report()["state_hash"]);
}

TEST(Checkpoint, OfAnotherSceneIsRefusedWithWhatDiffers) {
  const SceneFolder folder(endless_scene());
  ASSERT_TRUE(run_killed(folder, with(kNoPictures, {"--checkpoint", "0.1"}),
                         [&] { return fs::exists(folder.out() / "checkpoint.bin"); }));
  Json other = endless_scene();
  other["seed"] = 7;
  folder.write(other.dump(2));
  expect_refused(folder.run(with(kNoPictures, {"--resume"})), {"checkpoint.bin", "scene"});
}

TEST(Checkpoint, ThatIsNotThereIsMissed) {
  const SceneFolder folder;
  expect_refused(folder.run(with(kNoPictures, {"--resume"})), {"checkpoint.bin"});
}

TEST(RunFolder, ThatARunHoldsIsRefusedToASecond) {
  const SceneFolder folder(endless_scene());
  ProgramResult second;
  ASSERT_TRUE(run_killed(folder, kNoPictures, [&] {
    if (!fs::exists(folder.out() / "smoke")) return false;
    second = folder.run(kNoPictures);
    return true;
  }));
  expect_refused(second, {"--out"});
  EXPECT_LT(second.wall_s, 60.0) << "it waited for the first";
}

TEST(Controls, RecordedAndReplayedAreTheSameRun) {
  const SceneFolder folder;
  const std::string file = (folder / "controls.csv").string();
  const ProgramResult first = folder.run(with(kNoPictures, {"--record-controls", file}));
  ASSERT_EQ(first.code, 0) << first.told();
  const std::string hash = folder.report()["state_hash"];
  const ProgramResult second = folder.run(with(kNoPictures, {"--replay", file}));
  ASSERT_EQ(second.code, 0) << second.told();
  EXPECT_EQ(hash, folder.report()["state_hash"].get<std::string>());
}

TEST(Controls, ThatAreNotOnesAreRefusedWithTheirLine) {
  const SceneFolder folder;
  const fs::path file = folder / "controls.csv";
  std::ofstream(file) << "frame,tool,tip_x_m,tip_y_m,tip_z_m,jaw,power_W\n1,saw,0,0,0,1,0\n";
  expect_refused(folder.run(with(kNoPictures, {"--replay", file.string()})),
                 {"controls.csv:2", "saw"});
}

}  // namespace
}  // namespace viscera::test
