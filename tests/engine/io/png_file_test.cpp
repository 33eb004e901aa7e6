#include "engine/io/png_file.h"

#include <gtest/gtest.h>
#include <png.h>

#include <filesystem>
#include <vector>

#include "tests/engine/io/file_size_limit.h"
#include "tests/engine/io/file_text.h"
#include "tests/support/paths.h"

namespace viscera {
namespace {

namespace fs = std::filesystem;
using test::entries;
using test::TemporaryFolder;

std::vector<std::uint8_t> noise(int width, int height) {
  std::vector<std::uint8_t> rgb(3ull * width * height);
  std::uint32_t state = 1;
  for (std::uint8_t& byte : rgb) {
    state = state * 1664525u + 1013904223u;
    byte = static_cast<std::uint8_t>(state >> 24);
  }
  return rgb;
}

TEST(Png, ReadsBackTheSamePixels) {
  const TemporaryFolder folder;
  const std::vector<std::uint8_t> rgb = noise(37, 11);
  ASSERT_TRUE(write_png(folder / "a.png", 37, 11, rgb));

  png_image image = {};
  image.version = PNG_IMAGE_VERSION;
  ASSERT_TRUE(png_image_begin_read_from_file(&image, (folder / "a.png").c_str()));
  EXPECT_EQ(image.width, 37u);
  EXPECT_EQ(image.height, 11u);
  image.format = PNG_FORMAT_RGB;
  std::vector<std::uint8_t> read(PNG_IMAGE_SIZE(image));
  ASSERT_TRUE(png_image_finish_read(&image, nullptr, read.data(), 0, nullptr));
  EXPECT_EQ(read, rgb);
  EXPECT_EQ(entries(folder.path()), 1);
}

TEST(Png, RefusesPixelsThatDontFitItsSize) {
  const TemporaryFolder folder;
  const auto written = write_png(folder / "a.png", 4, 4, noise(4, 3));
  ASSERT_FALSE(written);
  EXPECT_NE(written.error().text().find("expected 4 x 4 pixels"), std::string::npos);
  EXPECT_FALSE(write_png(folder / "a.png", 0, 4, {}));
  EXPECT_FALSE(write_png(folder / "a.png", -1, -1, noise(1, 1)));
  EXPECT_EQ(entries(folder.path()), 0);
}

TEST(Png, SaysThatTheDiskIsFullAndLeavesNoPart) {
  const TemporaryFolder folder;
  fs::create_symlink("/dev/full", folder / "full.png");
  const auto full = write_png(folder / "full.png", 8, 8, noise(8, 8));
  ASSERT_FALSE(full);
  EXPECT_NE(full.error().text().find("No space left on device"), std::string::npos);

  const test::FileSizeLimit limit(10'000);
  EXPECT_FALSE(write_png(folder / "large.png", 200, 200, noise(200, 200)));
  EXPECT_EQ(entries(folder.path()), 1);
}

TEST(Png, IsReadByWhatWroteIt) {
  const TemporaryFolder folder;
  const std::vector<std::uint8_t> pixels = noise(37, 23);
  ASSERT_TRUE(write_png(folder / "a.png", 37, 23, pixels));
  const auto read = read_png(folder / "a.png");
  ASSERT_TRUE(read) << read.error().text();
  EXPECT_EQ(read->width, 37);
  EXPECT_EQ(read->height, 23);
  EXPECT_EQ(read->rgb, pixels);
}

TEST(Png, AbsentOrCutOffIsRefusedWithItsName) {
  const TemporaryFolder folder;
  ASSERT_TRUE(write_png(folder / "a.png", 37, 23, noise(37, 23)));
  fs::resize_file(folder / "a.png", fs::file_size(folder / "a.png") / 2);
  for (const char* name : {"a.png", "none.png"}) {
    const auto read = read_png(folder / name);
    ASSERT_FALSE(read) << name;
    EXPECT_NE(read.error().text().find(name), std::string::npos);
  }
}

}  // namespace
}  // namespace viscera
