#include "engine/io/exr_file.h"

#include <ImfArray.h>
#include <ImfChannelList.h>
#include <ImfDoubleAttribute.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfInputFile.h>
#include <ImfStringAttribute.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "tests/engine/io/file_size_limit.h"
#include "tests/support/paths.h"
#include "tests/support/program.h"

namespace viscera {
namespace {

namespace fs = std::filesystem;
using test::TemporaryFolder;

constexpr float kInfinity = std::numeric_limits<float>::infinity();

ExrPicture small_picture() {
  return {3,
          2,
          {{"clean.R", std::vector<float>{0.1f, 0.2f, 0.3f, 4.0f, 5.0f, 1e-3f}, true},
           {"depth", std::vector<float>{0.1f, kInfinity, 0.3f, 0.4f, std::nanf(""), 0.6f}},
           {"labels", std::vector<std::uint32_t>{0, 1, 2, 3, 4, 4000000000u}}},
          {{"scene", "test"}, {"comments", "two\nlines"}},
          {{"time_s", 1.25}}};
}

/// A channel as OpenEXR's own reader gives it.
template <class Value>
std::vector<Value> values(Imf::InputFile& file, const char* name, Imf::PixelType type) {
  const Imath::Box2i window = file.header().dataWindow();
  const int width = window.max.x + 1, height = window.max.y + 1;
  std::vector<Value> read(static_cast<std::size_t>(width) * height);
  Imf::FrameBuffer buffer;
  buffer.insert(name, Imf::Slice(type, reinterpret_cast<char*>(read.data()), sizeof(Value),
                                 sizeof(Value) * static_cast<std::size_t>(width)));
  file.setFrameBuffer(buffer);
  file.readPixels(0, height - 1);
  return read;
}

TEST(ExrFile, OpenExrReadsBackWhatWasWritten) {
  const TemporaryFolder folder;
  const fs::path path = folder / "picture.exr";
  ASSERT_TRUE(write_exr(path, small_picture()));
  Imf::InputFile file(path.string().c_str());
  EXPECT_TRUE(file.isComplete());
  ASSERT_NE(file.header().channels().findChannel("clean.R"), nullptr);
  EXPECT_EQ(file.header().channels().findChannel("clean.R")->type, Imf::HALF);
  EXPECT_EQ(file.header().channels().findChannel("depth")->type, Imf::FLOAT);
  EXPECT_EQ(file.header().channels().findChannel("labels")->type, Imf::UINT);
  const ExrPicture wrote = small_picture();
  const auto colour = values<float>(file, "clean.R", Imf::FLOAT);
  const auto& sent = std::get<std::vector<float>>(wrote.channels[0].values);
  for (std::size_t i = 0; i < 6; ++i) EXPECT_NEAR(colour[i], sent[i], 0x1p-11 * sent[i]);
  const auto depth = values<float>(file, "depth", Imf::FLOAT);
  EXPECT_EQ(depth[0], 0.1f);
  EXPECT_EQ(depth[1], kInfinity);
  EXPECT_TRUE(std::isnan(depth[4]));
  EXPECT_EQ(values<std::uint32_t>(file, "labels", Imf::UINT),
            std::get<std::vector<std::uint32_t>>(wrote.channels[2].values));
  EXPECT_EQ(file.header().typedAttribute<Imf::StringAttribute>("comments").value(), "two\nlines");
  EXPECT_EQ(file.header().typedAttribute<Imf::DoubleAttribute>("time_s").value(), 1.25);
}

TEST(ExrFile, TheFormatsOwnToolReadsTheHeader) {
  const TemporaryFolder folder;
  const fs::path path = folder / "picture.exr";
  ASSERT_TRUE(write_exr(path, small_picture()));
  if (test::run_command({"sh", "-c", "command -v exrheader"}).code != 0)
    GTEST_SKIP() << "there is no exrheader (package openexr)";
  const test::ProgramResult told = test::run_command({"exrheader", path.string()});
  EXPECT_EQ(told.code, 0) << told.told();
  for (const char* part : {"clean.R, 16-bit floating-point", "depth, 32-bit floating-point",
                           "labels, 32-bit unsigned integer", "scene (type string): \"test\""})
    EXPECT_NE(told.out.find(part), std::string::npos) << part << "\n" << told.out;
}

TEST(ExrFile, ADiskThatFillsLeavesTheOlderFileWhole) {
  const TemporaryFolder folder;
  const fs::path path = folder / "picture.exr";
  ASSERT_TRUE(write_exr(path, small_picture()));
  ExrPicture large{64, 64, {{"labels", std::vector<std::uint32_t>(64 * 64)}}, {}, {}};
  auto& noise = std::get<std::vector<std::uint32_t>>(large.channels[0].values);
  for (std::size_t i = 0; i < noise.size(); ++i)
    noise[i] = static_cast<std::uint32_t>(i * 2654435761u);
  {
    const test::FileSizeLimit full(4096);
    const auto done = write_exr(path, large);
    ASSERT_FALSE(done);
    EXPECT_NE(done.error().text().find(path.string()), std::string::npos) << done.error().text();
  }
  Imf::InputFile file(path.string().c_str());
  EXPECT_TRUE(file.isComplete());
  EXPECT_EQ(file.header().dataWindow().max.x, 2);
  EXPECT_EQ(std::distance(fs::directory_iterator(path.parent_path()), fs::directory_iterator()), 1);
}

TEST(ExrFile, ChannelsThatDontFitThePictureAreNamed) {
  ExrPicture picture = small_picture();
  std::get<std::vector<float>>(picture.channels[1].values).pop_back();
  const auto bytes = encode_exr(picture);
  ASSERT_FALSE(bytes);
  EXPECT_EQ(bytes.error().text(),
            "channel depth: found 5 values, expected one for each of 3 x 2 pixels");
  EXPECT_FALSE(encode_exr({}));
}

}  // namespace
}  // namespace viscera
