// Whatever ends a run, it leaves what it has: forces, film, and a report that says why.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/mount.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>

#include "engine/features/features.h"
#include "engine/gpu/egl_context.h"
#include "engine/run/run.h"
#include "engine/scene/load_scene.h"
#include "tests/tools/tiny_scene.h"

namespace viscera::test {
namespace {

namespace fs = std::filesystem;

/// For so long that it ends early.
Json long_scene() {
  Json scene = tiny_scene();
  scene["duration_s"] = 600;
  return scene;
}

long rows_of(const fs::path& table) {
  const std::string text = file_text(table);
  return std::count(text.begin(), text.end(), '\n') - 1;
}

/// The report of a run that failed, with forces up to there.
Json expect_left(const SceneFolder& folder, const ProgramResult& result) {
  expect_failed(result, 1, {});
  expect_whole_files(folder.out());
  if (!fs::exists(folder.out() / "report.json")) {
    ADD_FAILURE() << "no report: " << result.told();
    return Json::object();
  }
  Json report = folder.report();
  EXPECT_EQ(report["complete"], false);
  EXPECT_FALSE(report["failures"].empty());
  EXPECT_EQ(rows_of(folder.out() / "forces.csv"), report["frames"].get<long>());
  return report;
}

bool tells(const Json& report, const std::string& part) {
  return report.contains("reason") && report["reason"].is_string() &&
         report["reason"].get<std::string>().find(part) != std::string::npos;
}

TEST(FailedRun, TerminatedAndHungUpOnesLeaveWhatOneAfterCtrlCLeaves) {
  for (const int signal : {SIGTERM, SIGHUP}) {
    const SceneFolder folder(long_scene());
    ProgramCall call = folder.call({"--no-render"});
    const fs::path volume = folder.out() / "smoke" / "0003.vdb";
    call.interrupt_when = [&](const std::string&) { return fs::exists(volume); };
    call.interrupt_signal = signal;
    const ProgramResult result = run_program(call);
    ASSERT_TRUE(result.interrupted) << result.told();
    EXPECT_EQ(result.code, 128 + signal) << result.told();
    expect_whole_files(folder.out());
    const Json report = folder.report();
    EXPECT_EQ(report["complete"], false);
    EXPECT_TRUE(tells(report, strsignal(signal))) << report["reason"];
    EXPECT_TRUE(report["failures"].empty());
    EXPECT_EQ(rows_of(folder.out() / "forces.csv"), report["frames"].get<long>());
  }
}

/// The shell's `command` with the program and this scene in place of RUN.
ProgramResult shell(const SceneFolder& folder, std::string command) {
  const ProgramCall call = folder.call({"--no-render"});
  std::string run = "VISCERA_CACHE='" + call.cache.string() + "' " VISCERA_PROGRAM;
  for (const std::string& word : call.arguments)
    if (word != "--quiet") run += " '" + word + "'";
  command.replace(command.find("RUN"), 3, run);
  return run_command({"sh", "-c", command});
}

TEST(FailedRun, AFullStandardErrorAndAReaderThatGoesChangeNothing) {
  const SceneFolder folder;
  ASSERT_EQ(shell(folder, "RUN").code, 0);
  const std::string hash = folder.report()["state_hash"],
                    forces = file_text(folder.out() / "forces.csv");
  for (const char* command : {"RUN 2>/dev/full", "RUN >/dev/full 2>&1", "RUN 2>&-",
                              "code=$({ { RUN 2>&1; echo $? >&3; } | sh -c 'exec <&-; sleep 1'; } "
                              "3>&1); exit ${code:-99}"}) {
    fs::remove_all(folder.out());
    const ProgramResult result = shell(folder, command);
    EXPECT_EQ(result.code, 0) << command << result.told();
    const Json report = folder.report();
    EXPECT_EQ(report["complete"], true) << command;
    EXPECT_EQ(report["reason"], nullptr);
    EXPECT_EQ(report["state_hash"], hash) << command;
    EXPECT_EQ(file_text(folder.out() / "forces.csv"), forces) << command;
  }
}

/// A disk of its own of so many bytes; absent where a file system can't be mounted.
class SmallDisk {
 public:
  SmallDisk(fs::path at, std::size_t bytes) : at_(std::move(at)) {
    fs::create_directories(at_);
    const std::string size = "size=" + std::to_string(bytes);
    there_ = ::mount("tmpfs", at_.c_str(), "tmpfs", 0, size.c_str()) == 0;
  }
  ~SmallDisk() {
    if (there_) ::umount(at_.c_str());
  }
  SmallDisk(const SmallDisk&) = delete;
  SmallDisk& operator=(const SmallDisk&) = delete;
  bool there() const { return there_; }

 private:
  fs::path at_;
  bool there_ = false;
};

TEST(FailedRun, OnASmallDiskItEndsWithItsReport) {
  const SceneFolder folder(long_scene());
  const SmallDisk disk(folder.out(), 5'000'000);
  if (!disk.there()) GTEST_SKIP() << "no file system may be mounted";
  const Json report = expect_left(folder, folder.run({"--no-render"}));
  EXPECT_TRUE(tells(report, "smoke at ")) << report["reason"];
  EXPECT_TRUE(tells(report, "No space left on device")) << report["reason"];
  EXPECT_GT(report["frames"], 10);
  EXPECT_TRUE(fs::exists(folder.out() / "review.html"));
  EXPECT_TRUE(fs::exists(folder.out() / "profile.json"));
}

TEST(FailedRun, ADiskWithoutRoomToEndItIsRefusedBeforeItBegins) {
  const SceneFolder folder;
  const SmallDisk disk(folder.out(), 3'000'000);
  if (!disk.there()) GTEST_SKIP() << "no file system may be mounted";
  expect_refused(folder.run({"--no-render"}),
                 {"--out " + folder.out().string(), "found room for", "expected at least 4.5 MB"});
  EXPECT_EQ(fs::directory_iterator(folder.out()), fs::directory_iterator());
}

TEST(FailedRun, OneThatStopsOnAFullDiskGoesOnFromItsCheckpointWhenThereIsRoom) {
  Json scene = tiny_scene();
  scene["duration_s"] = 4.0;
  const SceneFolder whole(scene), folder(scene), endless(long_scene());
  constexpr std::uintmax_t kDisk = 128 << 20;
  const SmallDisk disk(folder.out(), kDisk);
  if (!disk.there()) GTEST_SKIP() << "no file system may be mounted";
  ProgramCall begun = endless.call({"--no-render", "--checkpoint", "0.1"});
  const fs::path checkpoint = endless.out() / "checkpoint.bin";
  begun.interrupt_when = [&](const std::string&) { return fs::exists(checkpoint); };
  ASSERT_EQ(run_program(begun).code, 130);
  const std::uintmax_t state = fs::file_size(checkpoint);
  ASSERT_EQ(whole.run({"--no-render"}).code, 0);
  std::uintmax_t volumes = 0;
  for (const fs::path& file : files_of(whole.out(), ".vdb")) volumes += fs::file_size(file);

  const fs::path ballast = folder.out() / "ballast";
  std::ofstream(ballast).close();
  const std::uintmax_t room = 4'500'000 + 3 * state + volumes / 2;
  ASSERT_LT(room, kDisk);
  const int file = ::open(ballast.c_str(), O_WRONLY);
  ASSERT_EQ(posix_fallocate(file, 0, static_cast<off_t>(kDisk - room)), 0);
  ::close(file);
  expect_left(folder, folder.run({"--no-render", "--checkpoint", "0.1"}));
  ASSERT_TRUE(fs::exists(folder.out() / "checkpoint.bin")) << folder.report()["reason"];
  fs::remove(ballast);
  const ProgramResult resumed = folder.run({"--no-render", "--resume"});
  ASSERT_EQ(resumed.code, 0) << resumed.told();
  EXPECT_EQ(folder.report()["complete"], true);
  EXPECT_EQ(folder.report()["state_hash"], whole.report()["state_hash"]);
  EXPECT_EQ(file_text(folder.out() / "forces.csv"), file_text(whole.out() / "forces.csv"));
}

TEST(FailedRun, AnExceptionInAThreadOfAStepLeavesTheFramesBefore) {
  const SceneFolder folder;
  SceneLoadOptions load;
  load.assets = project_file("assets");
  load.features = feature_keys();
  const auto scene = load_scene(folder.scene(), load);
  ASSERT_TRUE(scene) << scene.error().text();
  const auto tissues = load_tissues(load.assets / "tissues.json");
  ASSERT_TRUE(tissues) << tissues.error().text();
  RunOptions options;
  options.out = folder.out();
  options.assets = load.assets;
  options.render = false;
  options.use_cache = false;
  options.quiet = true;
  options.checkpoint_s = 1000.0;
  options.throw_at = 8;
  const auto report = run_scene(*scene, *tissues, options);
  ASSERT_TRUE(report) << report.error().text();
  EXPECT_FALSE(report->complete);
  EXPECT_EQ(report->frames, 7u);
  EXPECT_EQ(report->state_hash, "");
  ASSERT_EQ(report->failures.size(), 1u);
  EXPECT_EQ(report->failures[0].what, "simulation");
  EXPECT_TRUE(tells(folder.report(), "thrown for a test")) << folder.report()["reason"];
  EXPECT_EQ(rows_of(folder.out() / "forces.csv"), 7);
  EXPECT_FALSE(fs::exists(folder.out() / "checkpoint.bin")) << "of a state in the middle of a step";
  expect_whole_files(folder.out());
}

class FailedFilm : public testing::Test {
 protected:
  void SetUp() override {
    const auto context = EglContext::create();
    if (!context) GTEST_SKIP() << context.error().text();
    fs::create_directories(folder_ / "bin");
  }
  /// ffmpeg is this script for the run; $REAL is the real one.
  ProgramResult run_with(const std::string& script) {
    const std::string real = run_command({"sh", "-c", "command -v ffmpeg"}).out;
    const fs::path file = folder_ / "bin" / "ffmpeg";
    std::ofstream(file) << "#!/bin/sh\nREAL=" << real << script;
    fs::permissions(file, fs::perms::owner_all);
    ProgramCall call = folder_.call({"--quality", "draft"});
    call.variables = {"PATH=" + (folder_ / "bin").string() + ":" + std::getenv("PATH")};
    return run_program(call);
  }
  std::string pictures_of_film() const {
    return run_command({"ffprobe", "-v", "error", "-count_frames", "-show_entries",
                        "stream=nb_read_frames", "-of", "csv=p=0",
                        (folder_.out() / "film.mp4").string()})
        .out;
  }

  const SceneFolder folder_;
};

TEST_F(FailedFilm, AnEncoderThatGoesLeavesAFilmOfThePicturesUpToThere) {
  // Takes two pictures and a bit. The next one is sound.
  const ProgramResult result = run_with("if mkdir " + (folder_ / "once").string() +
                                        " 2>/dev/null; then head -c 6000000 >/dev/null; echo lost "
                                        ">&2; exit 3; fi\nexec $REAL \"$@\"\n");
  const Json report = expect_left(folder_, result);
  EXPECT_TRUE(tells(report, "film at ")) << report["reason"];
  EXPECT_TRUE(tells(report, "lost")) << report["reason"];
  const auto pictures = files_of(folder_.out() / "frames", ".png").size();
  EXPECT_GE(pictures, 2u);
  EXPECT_LT(pictures, 6u);
  EXPECT_EQ(report["pictures"], pictures);
  EXPECT_EQ(pictures_of_film(), std::to_string(pictures) + "\n");
}

TEST_F(FailedFilm, WithoutAnyEncoderTheRestStandsAndTheReportSaysSo) {
  const ProgramResult result = run_with("head -c 6000000 >/dev/null; echo lost >&2; exit 3\n");
  const Json report = expect_left(folder_, result);
  EXPECT_TRUE(tells(report, "film at ")) << report["reason"];
  EXPECT_FALSE(fs::exists(folder_.out() / "film.mp4"));
  EXPECT_GE(files_of(folder_.out() / "frames", ".png").size(), 2u);
  EXPECT_FALSE(files_of(folder_.out() / "smoke", ".vdb").empty());
}

}  // namespace
}  // namespace viscera::test
