#include "engine/simulator/controls_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "tests/support/paths.h"

namespace viscera {
namespace {

using testing::HasSubstr;

class ControlsFile : public testing::Test {
 protected:
  std::filesystem::path write(const std::string& text) {
    const std::filesystem::path file = folder_ / "controls.csv";
    std::ofstream(file, std::ios::binary) << text;
    return file;
  }
  std::string mistakes(const std::string& rows) {
    const auto read = read_controls(write(controls_header() + "\n" + rows), {"hook", "probe"}, 60);
    return read ? "" : read.error().text();
  }
  test::TemporaryFolder folder_;
};

TEST_F(ControlsFile, GivesBackTheVeryNumbers) {
  Controls controls;
  controls.tools = {{Vec3(0.1, 1.0 / 3.0, -1e-17), 0.25, 30.0}, {Vec3(1, 2, 3), 1.0, 0.0, true}};
  const std::string rows = controls_rows(1, {"hook", "probe"}, controls, 60) +
                           controls_rows(2, {"hook", "probe"}, controls, 60);
  const auto read = read_controls(write(controls_header() + "\n" + rows), {"hook", "probe"}, 60);
  ASSERT_TRUE(read) << read.error().text();
  ASSERT_EQ(read->size(), 2u);
  for (std::size_t i = 0; i < 2; ++i) {
    EXPECT_EQ((*read)[1].tools[i].tip, controls.tools[i].tip);
    EXPECT_EQ((*read)[1].tools[i].jaw, controls.tools[i].jaw);
    EXPECT_EQ((*read)[1].tools[i].power, controls.tools[i].power);
    EXPECT_EQ((*read)[1].tools[i].blade, controls.tools[i].blade);
  }
}

TEST_F(ControlsFile, RefusesWhatItIsNotWithLineFoundAndExpected) {
  EXPECT_THAT(mistakes(""), HasSubstr(":2: found the end, expected the first frame"));
  EXPECT_THAT(mistakes("1,hook,0,0,0,1,0,0,60\n"), HasSubstr(":3: found the end within frame 1"));
  EXPECT_THAT(mistakes("1,hook,0,0,0,1\n"), HasSubstr(":2: found 6 values, expected 9"));
  EXPECT_THAT(mistakes("1,hook,0,0,zero,1,0,0,60\n"),
              HasSubstr(":2: found \"zero\", expected a number"));
  EXPECT_THAT(mistakes("2,hook,0,0,0,1,0,0,60\n"), HasSubstr("expected 1, \"hook\""));
  EXPECT_THAT(mistakes("1,saw,0,0,0,1,0,0,60\n"), HasSubstr("\"saw\""));
  EXPECT_THAT(mistakes("1,hook,0,0,0,1,0,yes,60\n"),
              HasSubstr(":2: found \"yes\", expected 0 or 1"));
  EXPECT_THAT(mistakes(std::string(8 << 20, ',') + "\n"), HasSubstr("expected a row"));
}

TEST_F(ControlsFile, ReadsFilesOfBeforeTheKnifeAsOnesInWhichNobodyPullsIt) {
  const std::string before = "frame,tool,tip_x_m,tip_y_m,tip_z_m,jaw,power_W\n";
  const auto read = read_controls(write(before + "1,hook,0,0,1,1,30\n"), {"hook"}, 60);
  ASSERT_TRUE(read) << read.error().text();
  EXPECT_EQ((*read)[0].tools[0].power, 30.0);
  EXPECT_FALSE((*read)[0].tools[0].blade);
  const auto more = read_controls(write(before + "1,hook,0,0,1,1,30,1\n"), {"hook"}, 60);
  ASSERT_FALSE(more);
  EXPECT_THAT(more.error().text(), HasSubstr("found 8 values, expected 7"));
}

TEST_F(ControlsFile, RefusesFramesThatLastAnotherTime) {
  const std::string row = "1,hook,0,0,1,1,30,0,60\n";
  const auto other = read_controls(write(controls_header() + "\n" + row), {"hook"}, 30);
  ASSERT_FALSE(other);
  EXPECT_THAT(other.error().text(),
              HasSubstr(":2: found 60 frames a second, expected the scene's 30"));
  const std::string before = "frame,tool,tip_x_m,tip_y_m,tip_z_m,jaw,power_W,blade\n";
  EXPECT_TRUE(read_controls(write(before + "1,hook,0,0,1,1,30,0\n"), {"hook"}, 60));
  const auto old = read_controls(write(before + "1,hook,0,0,1,1,30,0\n"), {"hook"}, 120);
  ASSERT_FALSE(old);
  EXPECT_THAT(old.error().text(), HasSubstr("expected the scene's 120"));
}

TEST_F(ControlsFile, RefusesFilesThatAreNoControlsAndShowsNothingOfThem) {
  const auto other = read_controls(write("root:x:0:0\n"), {"hook"}, 60);
  ASSERT_FALSE(other);
  EXPECT_THAT(other.error().text(), HasSubstr("expected frame,tool"));
  EXPECT_THAT(other.error().text(), Not(HasSubstr("root")));
  EXPECT_FALSE(read_controls(folder_.path(), {"hook"}, 60));
  EXPECT_FALSE(read_controls(folder_ / "absent.csv", {"hook"}, 60));
}

TEST_F(ControlsFile, ListsTwentyMistakesAndNoMore) {
  std::string rows;
  for (int i = 0; i < 5000; ++i) rows += "x\n";
  const auto read = read_controls(write(controls_header() + "\n" + rows), {"hook"}, 60);
  ASSERT_FALSE(read);
  EXPECT_EQ(read.error().messages.size(), 20u);
}

}  // namespace
}  // namespace viscera
