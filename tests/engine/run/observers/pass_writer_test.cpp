#include "engine/run/observers/pass_writer.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <memory>
#include <string>

#include "tests/engine/io/file_size_limit.h"
#include "tests/engine/io/file_text.h"
#include "tests/support/paths.h"

namespace viscera {
namespace {

namespace fs = std::filesystem;
using test::TemporaryFolder;

PassImages images_of(float depth) {
  PassImages images;
  images.width = 64;
  images.height = 48;
  images.depth.assign(64 * 48, depth);
  // What no compression makes small.
  for (std::size_t i = 0; i < images.depth.size(); ++i)
    images.depth[i] += 1e-3f * static_cast<float>((i * 2654435761u) % 65536u);
  images.labels.assign(64 * 48, 1);
  return images;
}

std::shared_ptr<const PassImages> picture_of(float depth) {
  return std::make_shared<PassImages>(images_of(depth));
}

TEST(PassWriter, EveryPictureIsWrittenWithWhatItsFrameSaid) {
  const TemporaryFolder folder;
  PassWriter writer({Pass::kDepth, Pass::kLabels});
  const PassContext context{"scene", R"({"1":"liver"})", R"({"barrel":0})", 0.5, false};
  for (int i = 0; i < 5; ++i)
    writer.write(folder / (std::to_string(i) + ".exr"), picture_of(static_cast<float>(i)), context);
  const Result<void> finished = writer.finish();
  ASSERT_TRUE(finished) << finished.error().text();
  EXPECT_EQ(test::entries(folder.path()), 5);
  EXPECT_GT(writer.seconds(), 0.0);
  for (int i = 0; i < 5; ++i) {
    const fs::path alone = folder / ("alone" + std::to_string(i));
    const PassImages images = images_of(static_cast<float>(i));
    ASSERT_TRUE(write_exr(alone, exr_of({Pass::kDepth, Pass::kLabels}, images, context)));
    EXPECT_EQ(test::file_text(alone), test::file_text(folder / (std::to_string(i) + ".exr")));
  }
}

TEST(PassWriter, WhatIsQueuedIsWrittenBeforeItEnds) {
  const TemporaryFolder folder;
  {
    PassWriter writer({Pass::kDepth});
    for (int i = 0; i < 3; ++i)
      writer.write(folder / (std::to_string(i) + ".exr"), picture_of(1.0f), {});
  }
  EXPECT_EQ(test::entries(folder.path()), 3);
}

TEST(PassWriter, AFullDiskNamesTheFirstFileThatFailedAndLeavesTheOthersWhole) {
  const TemporaryFolder folder;
  PassWriter writer({Pass::kDepth});
  writer.write(folder / "0000.exr", picture_of(1.0f), {});
  ASSERT_TRUE(writer.finish());
  const auto size = fs::file_size(folder / "0000.exr");
  {
    const test::FileSizeLimit limit(2000);
    writer.write(folder / "0001.exr", picture_of(1.0f), {});
    writer.write(folder / "0002.exr", picture_of(1.0f), {});
    const Result<void> finished = writer.finish();
    ASSERT_FALSE(finished);
    EXPECT_NE(finished.error().text().find("0001.exr: can't be written"), std::string::npos)
        << finished.error().text();
    EXPECT_FALSE(writer.status());
  }
  EXPECT_EQ(test::entries(folder.path()), 1);
  EXPECT_EQ(fs::file_size(folder / "0000.exr"), size);
}

TEST(PassWriter, PixelsThatDontFitTheSizeAreRefusedWithTheFile) {
  const TemporaryFolder folder;
  PassWriter writer({Pass::kDepth});
  PassImages images = images_of(1.0f);
  images.depth.pop_back();
  writer.write(folder / "0000.exr", std::make_shared<PassImages>(std::move(images)), {});
  const Result<void> finished = writer.finish();
  ASSERT_FALSE(finished);
  EXPECT_NE(finished.error().text().find("0000.exr"), std::string::npos);
  EXPECT_EQ(test::entries(folder.path()), 0);
}

}  // namespace
}  // namespace viscera
