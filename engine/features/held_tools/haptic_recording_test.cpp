#include "engine/features/held_tools/haptic_recording.h"

#include <gtest/gtest.h>

#include <fstream>
#include <sstream>

#include "tests/haptics/servo_world.h"
#include "tests/support/paths.h"

namespace viscera::test {
namespace {

HapticRecording short_recording(std::size_t samples = 50) {
  SimulatedDeviceSettings settings;
  settings.path = path_along_z({{0.0, 0.01}, {0.2, -0.01}});
  SimulatedDevice device(settings);
  RecordingDevice recorder(device, 1e-3, samples);
  for (std::uint64_t tick = 0; tick < samples; ++tick) {
    recorder.read(tick);
    recorder.write(Vec3(0.1, 1.0 / 3.0, 1e-7 * static_cast<double>(tick)));
  }
  return recorder.recording();
}

std::string text_of(const std::filesystem::path& file) {
  std::ostringstream all;
  all << std::ifstream(file, std::ios::binary).rdbuf();
  return all.str();
}

void put(const std::filesystem::path& file, const std::string& text) {
  std::ofstream(file, std::ios::binary) << text;
}

/// The nth line's start in a text, from 1.
std::size_t line_start(const std::string& text, int line) {
  std::size_t at = 0;
  for (int i = 1; i < line; ++i) at = text.find('\n', at) + 1;
  return at;
}

std::string with_line(std::string text, int line, const std::string& instead) {
  const std::size_t from = line_start(text, line);
  return text.replace(from, text.find('\n', from) - from, instead);
}

void expect_refused(const std::filesystem::path& file, const std::vector<std::string>& words) {
  const auto loaded = load_recording(file);
  ASSERT_FALSE(loaded) << file;
  for (const std::string& word : words)
    EXPECT_NE(loaded.error().text().find(word), std::string::npos) << loaded.error().text();
}

class RecordingFile : public testing::TestWithParam<const char*> {};

TEST_P(RecordingFile, WhatIsWrittenIsReadBackToTheLastDigit) {
  const TemporaryFolder folder;
  HapticRecording recording = short_recording();
  recording.samples[7].state.connected = false;
  recording.samples[8].state.buttons = 0x80000001u;
  const auto file = folder / GetParam();
  ASSERT_TRUE(save_recording(file, recording));
  const auto loaded = load_recording(file);
  ASSERT_TRUE(loaded) << loaded.error().text();
  EXPECT_EQ(loaded->device, recording.device);
  EXPECT_EQ(loaded->dt, recording.dt);
  EXPECT_EQ(loaded->limits.friction, recording.limits.friction);
  EXPECT_EQ(loaded->limits.work_space.min(), recording.limits.work_space.min());
  ASSERT_EQ(loaded->samples.size(), recording.samples.size());
  for (std::size_t i = 0; i < recording.samples.size(); ++i) {
    const HapticSample &a = loaded->samples[i], &b = recording.samples[i];
    EXPECT_EQ(a.time, b.time);
    EXPECT_EQ(a.state.pose.position, b.state.pose.position);
    EXPECT_EQ(a.state.pose.orientation.coeffs(), b.state.pose.orientation.coeffs());
    EXPECT_EQ(a.state.buttons, b.state.buttons);
    EXPECT_EQ(a.state.sample, b.state.sample);
    EXPECT_EQ(a.state.connected, b.state.connected);
    EXPECT_EQ(a.force, b.force);
  }
}

TEST_P(RecordingFile, OneCutShortAnywhereIsRefused) {
  const TemporaryFolder folder;
  const auto whole = folder / GetParam();
  ASSERT_TRUE(save_recording(whole, short_recording(5)));
  const std::string text = text_of(whole);
  const auto cut = folder / (std::string("cut_") + GetParam());
  const std::size_t step = std::max<std::size_t>(1, text.size() / 300);
  for (std::size_t size = 0; size + 1 < text.size(); size += step) {
    put(cut, text.substr(0, size));
    EXPECT_FALSE(load_recording(cut)) << size << " of " << text.size() << " bytes";
  }
}

TEST_P(RecordingFile, TimeThatGoesBackAndNumbersThatAreNotFiniteAreRefusedWithTheirRow) {
  const TemporaryFolder folder;
  const bool csv = std::string(GetParam()).ends_with("csv");
  HapticRecording recording = short_recording(20);
  recording.samples[9].time = 0.002;
  ASSERT_TRUE(save_recording(folder / GetParam(), recording));
  // Twelve lines stand before the rows.
  expect_refused(
      folder / GetParam(),
      {GetParam(), csv ? "line 22:" : "row 10:", "expected time to rise, found 0.002 s"});
  recording = short_recording(20);
  recording.samples[4].state.pose.position.y() = std::numeric_limits<double>::quiet_NaN();
  ASSERT_TRUE(save_recording(folder / GetParam(), recording));
  expect_refused(folder / GetParam(), {csv ? "line 17:" : "row 5:", "expected a finite y_m"});
}

INSTANTIATE_TEST_SUITE_P(Haptics, RecordingFile, testing::Values("touch.csv", "touch.h5"));

TEST(RecordingCsv, EachBrokenLineIsNamedWithWhatWasExpected) {
  const TemporaryFolder folder;
  const auto file = folder / "touch.csv";
  ASSERT_TRUE(save_recording(file, short_recording(5)));
  const std::string good = text_of(file);
  const std::string row = "0,0,0,0.01,1,0,0,0,0,1,1,0,0,0";
  const auto refused = [&](int line, const std::string& instead, const std::string& words) {
    put(file, with_line(good, line, instead));
    expect_refused(file, {"line " + std::to_string(line) + ":", words});
  };
  put(file, with_line(good, 13, row));
  EXPECT_TRUE(load_recording(file));
  refused(1, "time,x,y,z", "expected \"# viscera haptic recording 1\", found \"time,x,y,z\"");
  refused(3, "# dt_s soon", "expected \"# dt_s \" and 1 number");
  refused(4, "# work_space_m 0 0 0 1 1", "6 numbers");
  put(file, with_line(good, 5, "# peak_force_N -1"));
  expect_refused(file, {"touch.csv: header: expected peak_force_N above 0, found -1"});
  refused(13, "1,2,3", "expected 14 numbers, found 3");
  refused(13, row + ",5", "expected 14 numbers, found more");
  refused(13, "0,0,0,x,1,0,0,0,0,1,1,0,0,0", "expected 14 numbers, found 3");
  refused(13, "0,0,0,0.01,0,0,0,0,0,1,1,0,0,0", "quaternion of length 1");
  refused(13, "0,0,0,0.01,1,0,0,0,0.5,1,1,0,0,0", "buttons");
  refused(13, "0,0,0,0.01,1,0,0,0,0,-1,1,0,0,0", "sample number");
  refused(13, "0,0,0,0.01,1,0,0,0,0,1,2,0,0,0", "connected");
  refused(18, "# end 6", "truncated: expected \"# end 5\", found \"# end 6\"");
}

TEST(RecordingFile, AnUnknownExtensionAndAMissingFileAreNamed) {
  const TemporaryFolder folder;
  expect_refused(folder / "touch.xml", {"touch.xml", ".csv or .h5", "\".xml\""});
  expect_refused(folder / "touch.csv", {"touch.csv", "found no such file, expected a recording"});
  EXPECT_FALSE(save_recording(folder / "touch.xml", short_recording()));
}

}  // namespace
}  // namespace viscera::test
