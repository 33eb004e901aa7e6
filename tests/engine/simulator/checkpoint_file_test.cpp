#include "engine/simulator/checkpoint_file.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <span>
#include <string>

#include "tests/engine/io/file_size_limit.h"
#include "tests/engine/io/file_text.h"
#include "tests/support/paths.h"

namespace viscera {
namespace {

namespace fs = std::filesystem;
using test::file_text;
using test::put_text;
using test::TemporaryFolder;

std::vector<std::byte> bytes_of(const std::string& text) {
  const auto bytes = std::as_bytes(std::span(text));
  return {bytes.begin(), bytes.end()};
}

Checkpoint example() {
  return {{"1.2.3", "aa11", "a processor (64 bit, little endian)", "bb22"},
          {{"simulation", bytes_of(std::string(300, 'x') + '\0' + "end")},
           {"empty", {}},
           {"forces", bytes_of("time_s\n0.016\n")}}};
}

bool same(const Checkpoint& a, const Checkpoint& b) {
  if (a.identity != b.identity || a.parts.size() != b.parts.size()) return false;
  for (std::size_t i = 0; i < a.parts.size(); ++i)
    if (a.parts[i].name != b.parts[i].name || a.parts[i].bytes != b.parts[i].bytes) return false;
  return true;
}

std::string refusal(const fs::path& file, const CheckpointIdentity& expected) {
  const auto read = read_checkpoint(file, expected);
  return read ? "" : read.error().text();
}

TEST(CheckpointFile, ReadsBackAsItWasWritten) {
  const TemporaryFolder folder;
  const fs::path file = folder / "checkpoint.bin";
  ASSERT_TRUE(write_checkpoint(file, example()));
  EXPECT_EQ(test::entries(folder.path()), 1);
  const auto read = read_checkpoint(file, example().identity);
  ASSERT_TRUE(read) << read.error().text();
  EXPECT_TRUE(same(*read, example()));
  ASSERT_NE(read->find("forces"), nullptr);
  EXPECT_EQ(read->find("forces")->bytes, example().parts[2].bytes);
  EXPECT_EQ(read->find("film"), nullptr);
}

TEST(CheckpointFile, CutOffAtAnyLengthIsRefusedWithItsName) {
  const TemporaryFolder folder;
  const fs::path file = folder / "checkpoint.bin";
  ASSERT_TRUE(write_checkpoint(file, example()));
  const std::string whole = file_text(file);
  for (std::size_t length = 0; length < whole.size(); ++length) {
    put_text(file, whole.substr(0, length));
    EXPECT_NE(refusal(file, example().identity).find(file.string() + ": found"), std::string::npos)
        << length;
  }
  put_text(file, whole + "x");
  EXPECT_NE(refusal(file, example().identity).find("damaged"), std::string::npos);
}

TEST(CheckpointFile, AnyFlippedBitIsRefused) {
  const TemporaryFolder folder;
  const fs::path file = folder / "checkpoint.bin";
  ASSERT_TRUE(write_checkpoint(file, example()));
  const std::string whole = file_text(file);
  for (std::size_t bit = 0; bit < 8 * whole.size(); ++bit) {
    std::string damaged = whole;
    damaged[bit / 8] = static_cast<char>(damaged[bit / 8] ^ (1 << (bit % 8)));
    put_text(file, damaged);
    EXPECT_NE(refusal(file, example().identity), "") << "bit " << bit;
  }
}

TEST(CheckpointFile, OfAnotherVersionSceneMachineOrLayoutIsRefusedWithAllThatDiffers) {
  const TemporaryFolder folder;
  const fs::path file = folder / "checkpoint.bin";
  ASSERT_TRUE(write_checkpoint(file, example()));
  CheckpointIdentity other = example().identity;
  other.program = "1.3.0";
  EXPECT_EQ(refusal(file, other),
            file.string() + ": found a checkpoint of version 1.2.3, expected 1.3.0");
  other.scene = "cc33";
  other.machine = "another";
  other.layout = "dd44";
  const std::string all = refusal(file, other);
  for (const char* part :
       {"version 1.2.3, expected 1.3.0", "scene with hash aa11, expected cc33",
        "machine a processor (64 bit, little endian), expected another", "bb22, expected dd44"})
    EXPECT_NE(all.find(part), std::string::npos) << part << " isn't in\n" << all;
}

TEST(CheckpointFile, NoFileAndAForeignOneAreToldApart) {
  const TemporaryFolder folder;
  EXPECT_NE(refusal(folder / "none", example().identity).find("no such file"), std::string::npos);
  put_text(folder / "foreign", std::string(200, 'a'));
  EXPECT_NE(refusal(folder / "foreign", example().identity).find("found no checkpoint"),
            std::string::npos);
}

TEST(CheckpointFile, OnAFullDiskTheLastWholeOneStays) {
  const TemporaryFolder folder;
  const fs::path file = folder / "checkpoint.bin";
  ASSERT_TRUE(write_checkpoint(file, example()));
  Checkpoint greater = example();
  greater.parts[0].bytes.resize(100000);
  {
    const test::FileSizeLimit limit(2000);
    const Result<void> written = write_checkpoint(file, greater);
    ASSERT_FALSE(written);
    EXPECT_NE(written.error().text().find("checkpoint.bin: can't be written"), std::string::npos);
  }
  EXPECT_EQ(test::entries(folder.path()), 1);
  const auto read = read_checkpoint(file, example().identity);
  ASSERT_TRUE(read);
  EXPECT_TRUE(same(*read, example()));
}

}  // namespace
}  // namespace viscera
