#include "engine/io/film.h"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <cstdlib>
#include <sstream>
#include <string>
#include <vector>

#include "tests/engine/io/file_size_limit.h"
#include "tests/engine/io/file_text.h"
#include "tests/support/paths.h"

namespace viscera {
namespace {

namespace fs = std::filesystem;
using test::entries;
using test::TemporaryFolder;

constexpr int kWidth = 128, kHeight = 72;

std::vector<std::uint8_t> plain(std::uint8_t r, std::uint8_t g, std::uint8_t b) {
  std::vector<std::uint8_t> rgb;
  for (int i = 0; i < kWidth * kHeight; ++i) rgb.insert(rgb.end(), {r, g, b});
  return rgb;
}

std::string output_of(const std::string& command) {
  std::string text;
  std::FILE* pipe = popen(command.c_str(), "r");
  std::array<char, 4096> part;
  while (const std::size_t got = std::fread(part.data(), 1, part.size(), pipe)) {
    text.append(part.data(), got);
  }
  pclose(pipe);
  return text;
}

/// The PATH for the scope.
class SearchPath {
 public:
  explicit SearchPath(const std::string& path) : old_(std::getenv("PATH")) {
    setenv("PATH", path.c_str(), 1);
  }
  ~SearchPath() { setenv("PATH", old_.c_str(), 1); }

 private:
  std::string old_;
};

TEST(Film, PlaysEverywhereAndKeepsItsColours) {
  const TemporaryFolder folder;
  const fs::path file = folder / "film.mp4";
  auto film = Film::start(file, kWidth, kHeight);
  ASSERT_TRUE(film) << film.error().text();
  for (int frame = 0; frame < 15; ++frame) ASSERT_TRUE((*film)->add(plain(180, 40, 30)));
  EXPECT_FALSE(fs::exists(file));
  const auto finished = (*film)->finish();
  ASSERT_TRUE(finished) << finished.error().text();
  EXPECT_EQ(entries(folder.path()), 1);

  const std::string about = output_of(
      "ffprobe -v error -count_frames -show_entries stream=codec_name,width,height,pix_fmt,"
      "color_space,r_frame_rate,nb_read_frames -of csv=p=0 '" +
      file.string() + "'");
  EXPECT_EQ(about, "h264,128,72,yuv420p,bt709,30/1,15\n");
  // The index stands before the pictures: a browser starts before it has the whole file.
  const std::string bytes = test::file_text(file);
  EXPECT_LT(bytes.find("moov"), bytes.find("mdat"));

  const std::string rgb =
      output_of("ffmpeg -v error -i '" + file.string() +
                "' -vf scale=in_color_matrix=bt709,format=rgb24 -frames:v 1 -f rawvideo -");
  ASSERT_EQ(rgb.size(), 3u * kWidth * kHeight);
  const std::size_t middle = 3 * (kWidth * kHeight / 2 + kWidth / 2);
  EXPECT_NEAR(static_cast<std::uint8_t>(rgb[middle]), 180, 4);
  EXPECT_NEAR(static_cast<std::uint8_t>(rgb[middle + 1]), 40, 4);
  EXPECT_NEAR(static_cast<std::uint8_t>(rgb[middle + 2]), 30, 4);
}

TEST(Film, HasAKeyFrameEveryHalfSecondSoThatAScrubberAnswersAtOnce) {
  const TemporaryFolder folder;
  const fs::path file = folder / "film.mp4";
  auto film = Film::start(file, kWidth, kHeight);
  ASSERT_TRUE(film) << film.error().text();
  for (int frame = 0; frame < 40; ++frame)
    ASSERT_TRUE((*film)->add(plain(180, static_cast<std::uint8_t>(40 + frame), 30)));
  const auto finished = (*film)->finish();
  ASSERT_TRUE(finished) << finished.error().text();
  std::istringstream packets(
      output_of("ffprobe -v error -show_entries packet=flags -of csv=p=0 '" + file.string() + "'"));
  int count = 0, since_key = 0, longest = 0;
  for (std::string flags; std::getline(packets, flags); ++count) {
    since_key = flags.starts_with('K') ? 0 : since_key + 1;
    longest = std::max(longest, since_key);
  }
  EXPECT_EQ(count, 40);
  EXPECT_LE(longest, 14);
}

TEST(Film, DroppedUnfinishedLeavesNothing) {
  const TemporaryFolder folder;
  {
    auto film = Film::start(folder / "film.mp4", kWidth, kHeight);
    ASSERT_TRUE(film);
    ASSERT_TRUE((*film)->add(plain(0, 0, 0)));
  }
  EXPECT_EQ(entries(folder.path()), 0);
}

TEST(Film, SaysThatFfmpegIsMissing) {
  const TemporaryFolder folder;
  const SearchPath nowhere((folder / "no_programs").string());
  const auto film = Film::start(folder / "film.mp4", kWidth, kHeight);
  ASSERT_FALSE(film);
  EXPECT_NE(film.error().text().find("needs the program ffmpeg on the PATH"), std::string::npos);
  EXPECT_EQ(entries(folder.path()), 0);
}

TEST(Film, QuotesAnFfmpegThatGivesUpWithoutDyingOfSigpipe) {
  const TemporaryFolder folder;
  fs::create_directory(folder / "bin");
  test::put_text(folder / "bin/ffmpeg", "#!/bin/sh\necho 'Unknown encoder libx264' >&2\nexit 3\n");
  chmod((folder / "bin/ffmpeg").c_str(), 0755);
  const SearchPath path((folder / "bin").string() + ":" + std::getenv("PATH"));
  auto film = Film::start(folder / "film.mp4", 1280, 720);
  ASSERT_TRUE(film);
  const std::vector<std::uint8_t> frame(3 * 1280 * 720);
  Result<void> added;
  for (int i = 0; i < 20 && added; ++i) added = (*film)->add(frame);
  ASSERT_FALSE(added);
  EXPECT_NE(added.error().text().find("(exit code 3):\nUnknown encoder libx264"), std::string::npos)
      << added.error().text();
  EXPECT_FALSE((*film)->add(frame));
  EXPECT_FALSE((*film)->finish());
  film->reset();
  EXPECT_EQ(entries(folder.path()), 1);
}

TEST(Film, GivesUpAnEncoderThatTakesNothingAndOneThatDoesNotEnd) {
  const TemporaryFolder folder;
  fs::create_directory(folder / "bin");
  const SearchPath path((folder / "bin").string() + ":" + std::getenv("PATH"));
  const Film::Settings settings{.patience = std::chrono::milliseconds(300)};
  for (const bool takes : {false, true}) {
    test::put_text(folder / "bin/ffmpeg", takes ? "#!/bin/sh\ncat >/dev/null; exec sleep 1000\n"
                                                : "#!/bin/sh\nexec sleep 1000\n");
    chmod((folder / "bin/ffmpeg").c_str(), 0755);
    auto film = Film::start(folder / "film.mp4", 1280, 720, settings);
    ASSERT_TRUE(film);
    const std::vector<std::uint8_t> frame(3 * 1280 * 720);
    Result<void> done;
    for (int i = 0; i < 5 && done; ++i) done = (*film)->add(frame);
    EXPECT_EQ(done.has_value(), takes);
    if (done) done = (*film)->finish();
    ASSERT_FALSE(done);
    EXPECT_NE(done.error().text().find("did nothing for 300 ms"), std::string::npos)
        << done.error().text();
  }
  EXPECT_EQ(entries(folder.path()), 1);
}

TEST(Film, WithoutFramesIsAnError) {
  const TemporaryFolder folder;
  auto film = Film::start(folder / "film.mp4", kWidth, kHeight);
  ASSERT_TRUE(film);
  const auto finished = (*film)->finish();
  EXPECT_FALSE(finished);
  film->reset();
  EXPECT_EQ(entries(folder.path()), 0);
}

TEST(Film, OnAFullDiskFailsAndLeavesNoPart) {
  const TemporaryFolder folder;
  {
    const test::FileSizeLimit limit(2'000);
    auto film = Film::start(folder / "film.mp4", kWidth, kHeight);
    ASSERT_TRUE(film);
    std::vector<std::uint8_t> noisy(3 * kWidth * kHeight);
    std::uint32_t state = 1;
    Result<void> result;
    for (int frame = 0; frame < 30 && result; ++frame) {
      for (std::uint8_t& byte : noisy) {
        state = state * 1664525u + 1013904223u;
        byte = static_cast<std::uint8_t>(state >> 24);
      }
      result = (*film)->add(noisy);
    }
    if (result) result = (*film)->finish();
    ASSERT_FALSE(result);
    EXPECT_NE(result.error().text().find("film.mp4: ffmpeg couldn't make the film"),
              std::string::npos);
    EXPECT_NE(result.error().text().find("File too large"), std::string::npos)
        << result.error().text();
  }
  EXPECT_EQ(entries(folder.path()), 0);
}

TEST(Film, RefusesOddSizesWrongFramesAndMissingFolders) {
  const TemporaryFolder folder;
  EXPECT_FALSE(Film::start(folder / "film.mp4", 127, 72));
  EXPECT_FALSE(Film::start(folder / "film.mp4", 128, 0));
  EXPECT_FALSE(Film::start(folder / "missing/film.mp4", 128, 72));
  auto film = Film::start(folder / "film.mp4", kWidth, kHeight);
  ASSERT_TRUE(film);
  EXPECT_FALSE((*film)->add(std::vector<std::uint8_t>(100)));
}

}  // namespace
}  // namespace viscera
