// A filmed run from end to end: every file that a reviewer opens.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <set>
#include <string>

#include "engine/gpu/egl_context.h"
#include "tests/tools/tiny_scene.h"

namespace viscera::test {
namespace {

namespace fs = std::filesystem;

class FilmedRun : public testing::Test {
 protected:
  void SetUp() override {
    const auto context = EglContext::create();
    if (!context) GTEST_SKIP() << context.error().text();
  }
};

/// What ffprobe says of the film's stream, "key=value" by lines.
std::string film_stream(const fs::path& film) {
  return run_command({"ffprobe", "-v", "error", "-select_streams", "v:0", "-count_frames",
                      "-show_entries",
                      "stream=codec_name,width,height,pix_fmt,r_frame_rate,nb_read_frames", "-of",
                      "default=noprint_wrappers=1", film.string()})
      .out;
}

TEST_F(FilmedRun, WritesFilmFramesVolumesCurvesProfileReportAndReview) {
  const SceneFolder folder;
  const ProgramResult result = folder.run();
  ASSERT_EQ(result.code, 0) << result.told();
  const fs::path out = folder.out();
  expect_whole_files(out);

  const std::string stream = film_stream(out / "film.mp4");
  for (const char* entry : {"codec_name=h264", "width=1280", "height=720", "pix_fmt=yuv420p",
                            "r_frame_rate=30/1", "nb_read_frames=6"})
    EXPECT_NE(stream.find(entry), std::string::npos) << entry << " isn't in\n" << stream;

  const auto frames = files_of(out / "frames", ".png");
  ASSERT_EQ(frames.size(), 6u);
  EXPECT_EQ(frames.front().filename(), "0000.png");
  EXPECT_EQ(frames.back().filename(), "0005.png");

  const auto volumes = files_of(out / "smoke", ".vdb");
  ASSERT_FALSE(volumes.empty());
  EXPECT_LE(volumes.size(), 6u);
  EXPECT_EQ(volumes.back().filename(), "0005.vdb") << "a volume has its picture's number";

  const Json report = folder.report();
  const std::string forces = file_text(out / "forces.csv");
  EXPECT_TRUE(forces.starts_with("time_s,hook_x_m,hook_y_m,hook_z_m,hook_fx_N")) << forces;
  EXPECT_EQ(std::count(forces.begin(), forces.end(), '\n'), report["frames"].get<long>() + 1);

  const Json profile = Json::parse(file_text(out / "profile.json"));
  ASSERT_TRUE(profile.contains("traceEvents"));
  for (const char* stage : {"find contacts", "deform organs", "move smoke", "draw", "encode"})
    EXPECT_TRUE(std::any_of(profile["traceEvents"].begin(), profile["traceEvents"].end(),
                            [&](const Json& event) { return event["name"] == stage; }))
        << stage;

  EXPECT_EQ(report["pictures"], 6);
  EXPECT_FALSE(report["renderer"].get<std::string>().empty());
  const std::string review = file_text(out / "review.html");
  EXPECT_NE(review.find("film.mp4"), std::string::npos);
  EXPECT_NE(review.find(report["state_hash"].get<std::string>()), std::string::npos);
}

TEST_F(FilmedRun, PicturesDontChangeTheSimulation) {
  const SceneFolder folder;
  ASSERT_EQ(folder.run({"--duration", "0.07"}).code, 0);
  const std::string filmed = folder.report()["state_hash"];
  ASSERT_EQ(folder.run({"--duration", "0.07", "--no-render"}).code, 0);
  EXPECT_EQ(folder.report()["state_hash"], filmed);
}

TEST_F(FilmedRun, SnapshotsMakeThesePicturesAndNoFilm) {
  const SceneFolder folder;
  const ProgramResult result = folder.run({"--snapshots", "0.05,0.19"});
  ASSERT_EQ(result.code, 0) << result.told();
  EXPECT_EQ(files_of(folder.out(), ".png").size(), 2u);
  EXPECT_FALSE(fs::exists(folder.out() / "film.mp4"));
}

TEST_F(FilmedRun, EveryQualityGivesPicturesAndAnUnknownOneIsRefused) {
  const SceneFolder folder;
  std::set<std::string> pictures;
  for (const char* quality : {"draft", "review", "final"}) {
    const ProgramResult result = folder.run({"--snapshots", "0.1", "--quality", quality});
    ASSERT_EQ(result.code, 0) << result.told();
    const auto files = files_of(folder.out(), ".png");
    ASSERT_EQ(files.size(), 1u);
    pictures.insert(file_text(files[0]));
  }
  EXPECT_EQ(pictures.size(), 3u) << "each is another picture";
  const ProgramResult refused = folder.run({"--quality", "best"});
  EXPECT_EQ(refused.code, 2);
  for (const char* part : {"--quality", "best", "draft", "review", "final"})
    EXPECT_NE(refused.told().find(part), std::string::npos) << refused.told();
}

TEST_F(FilmedRun, ShorterThanOnePictureGoesWithoutFilm) {
  const SceneFolder folder;
  const ProgramResult result = folder.run({"--duration", "0.02"});
  EXPECT_EQ(result.code, 0) << result.told();
  EXPECT_EQ(folder.report()["pictures"], 0);
  EXPECT_FALSE(fs::exists(folder.out() / "film.mp4"));
  expect_whole_files(folder.out());
}

TEST_F(FilmedRun, InterruptedKeepsAFilmOfWhatWasDrawn) {
  Json scene = tiny_scene();
  scene["duration_s"] = 600;
  const SceneFolder folder(scene);
  ProgramCall call = folder.call();
  const fs::path second = folder.out() / "frames" / "0001.png";
  call.interrupt_when = [second](const std::string&) { return fs::exists(second); };
  const ProgramResult result = run_program(call);
  ASSERT_TRUE(result.interrupted);
  EXPECT_EQ(result.code, 130) << result.told();
  expect_whole_files(folder.out());
  const auto pictures = files_of(folder.out() / "frames", ".png").size();
  EXPECT_NE(film_stream(folder.out() / "film.mp4")
                .find("nb_read_frames=" + std::to_string(pictures) + "\n"),
            std::string::npos);
}

TEST_F(FilmedRun, AFullDiskIsNamedAndLeavesWholeFilesOnly) {
  const SceneFolder folder;
  ASSERT_EQ(folder.run({"--no-render"}).code, 0);
  ProgramCall call = folder.call();
  call.greatest_file = 30000;                                          // less than a picture
  expect_failed(run_program(call), 1, {"0000.", "can't be written"});  // the volume or the picture
  expect_whole_files(folder.out());
  EXPECT_EQ(folder.report()["complete"], false);
  const fs::path film = folder.out() / "film.mp4";  // of what pictures there were
  if (fs::exists(film)) {
    EXPECT_NE(film_stream(film).find("nb_read_frames="), std::string::npos);
  }
}

TEST_F(FilmedRun, SmokeInfoTellsTheMassOfAWrittenVolume) {
  const SceneFolder folder;
  ASSERT_EQ(folder.run({"--no-render"}).code, 0);
  const auto volumes = files_of(folder.out() / "smoke", ".vdb");
  ASSERT_FALSE(volumes.empty());
  const ProgramResult info = run_program({.arguments = {"smoke-info", volumes.back().string()}});
  EXPECT_EQ(info.code, 0) << info.told();
  const auto mass = info.out.find("mass ");
  ASSERT_NE(mass, std::string::npos) << info.out;
  // 30 W for less than 0.2 s boil at most 2.3 mg of water, of which 5 % are smoke.
  const double milligrams = std::stod(info.out.substr(mass + 5));
  EXPECT_GT(milligrams, 1e-3);
  EXPECT_LE(milligrams, 0.12);
  EXPECT_NE(info.out.find("volume plume"), std::string::npos);
}

TEST(SmokeInfo, RefusesWhatIsNoVolume) {
  const SceneFolder folder;
  expect_refused(run_program({.arguments = {"smoke-info", folder.scene().string()}}),
                 {"tiny.json", ".vdb"});
  expect_refused(run_program({.arguments = {"smoke-info", (folder / "none.vdb").string()}}),
                 {"none.vdb", "no such file"});
}

}  // namespace
}  // namespace viscera::test
