#include "engine/io/atomic_file.h"

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include "tests/engine/io/file_size_limit.h"
#include "tests/engine/io/file_text.h"
#include "tests/support/paths.h"

namespace viscera {
namespace {

namespace fs = std::filesystem;
using test::entries;
using test::file_text;
using test::FileSizeLimit;
using test::TemporaryFolder;

TEST(AtomicFile, HasItsNameOnlyOnceWhole) {
  const TemporaryFolder folder;
  auto out = AtomicFile::create(folder / "a.txt");
  ASSERT_TRUE(out);
  out->write("half ");
  EXPECT_FALSE(fs::exists(folder / "a.txt"));
  out->write("whole");
  ASSERT_TRUE(out->commit());
  EXPECT_EQ(file_text(folder / "a.txt"), "half whole");
  EXPECT_EQ(entries(folder.path()), 1);
}

TEST(AtomicFile, LeavesNothingWhenDropped) {
  const TemporaryFolder folder;
  {
    auto out = AtomicFile::create(folder / "a.txt");
    ASSERT_TRUE(out);
    out->write("half");
  }
  EXPECT_EQ(entries(folder.path()), 0);
}

TEST(AtomicFile, KeepsTheOldFileUntilTheNewOneIsWhole) {
  const TemporaryFolder folder;
  ASSERT_TRUE(write_file(folder / "a.txt", "old"));
  auto out = AtomicFile::create(folder / "a.txt");
  ASSERT_TRUE(out);
  out->write("new");
  EXPECT_EQ(file_text(folder / "a.txt"), "old");
  ASSERT_TRUE(out->commit());
  EXPECT_EQ(file_text(folder / "a.txt"), "new");
}

TEST(AtomicFile, ATableOnAFullDiskKeepsItsWholeLinesAndStillFails) {
  const TemporaryFolder folder;
  {
    const FileSizeLimit limit(100'005);
    auto out = AtomicFile::create(folder / "a.csv");
    ASSERT_TRUE(out);
    for (int line = 0; line < 20'000; ++line) out->write("12345678\n");  // 9 bytes
    EXPECT_FALSE(out->status());
    const auto kept = out->commit_lines();
    ASSERT_FALSE(kept);
    for (const char* part : {"a.csv: can't be written: File too large", "lines up to there"})
      EXPECT_NE(kept.error().text().find(part), std::string::npos) << kept.error().text();
  }
  const std::string text = file_text(folder / "a.csv");
  EXPECT_EQ(text.size(), 100'005u / 9 * 9);
  EXPECT_TRUE(text.ends_with("\n12345678\n"));
  EXPECT_EQ(entries(folder.path()), 1);
}

TEST(AtomicFile, ATableThatGetsRoomAtItsEndIsWhole) {
  const TemporaryFolder folder;
  auto out = AtomicFile::create(folder / "a.csv");
  ASSERT_TRUE(out);
  std::string all;
  {
    const FileSizeLimit limit(30'000);
    while (!out->failed()) {
      const std::string line = "row " + std::to_string(all.size()) + "\n";
      out->write(line);
      all += line;
    }
    EXPECT_FALSE(out->status());
  }
  const auto committed = out->commit_lines();
  ASSERT_TRUE(committed) << committed.error().text();
  EXPECT_EQ(file_text(folder / "a.csv"), all) << "also the line at which it failed";
}

TEST(AtomicFile, ATableOfWhichNoLineFitsLeavesNothing) {
  const TemporaryFolder folder;
  {
    const FileSizeLimit limit(5);
    auto out = AtomicFile::create(folder / "a.csv");
    ASSERT_TRUE(out);
    out->write("time_s,x_m\n");
    EXPECT_FALSE(out->commit_lines());
  }
  EXPECT_EQ(entries(folder.path()), 0);
}

TEST(AtomicFile, WritesMoreThanItsBufferInOrder) {
  const TemporaryFolder folder;
  auto out = AtomicFile::create(folder / "a.txt");
  ASSERT_TRUE(out);
  std::string all;
  for (const std::size_t size : {10u, 65'530u, 3u, 200'000u, 65'536u, 1u}) {
    const std::string part(size, static_cast<char>('a' + all.size() % 26));
    out->write(part);
    all += part;
  }
  ASSERT_TRUE(out->commit(Durable::kNo));
  EXPECT_EQ(file_text(folder / "a.txt"), all);
}

TEST(AtomicFile, NamesAMissingFolder) {
  const TemporaryFolder folder;
  const auto written = write_file(folder / "missing/a.txt", "text");
  ASSERT_FALSE(written);
  EXPECT_NE(written.error().text().find("a.txt: can't be written: the folder"), std::string::npos);
  EXPECT_NE(written.error().text().find("missing doesn't exist"), std::string::npos);
}

TEST(AtomicFile, RefusesTheNameOfAFolder) {
  const TemporaryFolder folder;
  const auto written = write_file(folder.path(), "text");
  ASSERT_FALSE(written);
  EXPECT_NE(written.error().text().find("Is a directory"), std::string::npos);
}

TEST(AtomicFile, SaysThatTheDiskIsFull) {
  const TemporaryFolder folder;
  fs::create_symlink("/dev/full", folder / "a.txt");
  const auto written = write_file(folder / "a.txt", "text");
  ASSERT_FALSE(written);
  EXPECT_EQ(written.error().text(),
            (folder / "a.txt").string() + ": can't be written: No space left on device");
  EXPECT_EQ(entries(folder.path()), 1);
}

TEST(AtomicFile, RemovesThePartThatFittedOnAFullDisk) {
  const TemporaryFolder folder;
  ASSERT_TRUE(write_file(folder / "a.txt", "old"));
  const FileSizeLimit limit(100'000);
  const auto written = write_file(folder / "a.txt", std::string(200'000, 'x'));
  ASSERT_FALSE(written);
  EXPECT_NE(written.error().text().find("File too large"), std::string::npos);
  EXPECT_EQ(file_text(folder / "a.txt"), "old");
  EXPECT_EQ(entries(folder.path()), 1);
}

TEST(OutFolder, IsCreatedWithItsParentsAndLeftEmpty) {
  const TemporaryFolder folder;
  ASSERT_TRUE(check_out_folder(folder / "a/b/c"));
  EXPECT_TRUE(fs::is_directory(folder / "a/b/c"));
  EXPECT_EQ(entries(folder / "a/b/c"), 0);
  EXPECT_TRUE(check_out_folder(folder / "a/b/c"));
}

TEST(OutFolder, MayNotBeAFile) {
  const TemporaryFolder folder;
  ASSERT_TRUE(write_file(folder / "a", "text"));
  const auto checked = check_out_folder(folder / "a");
  ASSERT_FALSE(checked);
  EXPECT_NE(checked.error().text().find("found a file"), std::string::npos);
  EXPECT_FALSE(check_out_folder(folder / "a/b"));
  EXPECT_FALSE(check_out_folder(""));
}

TEST(OutFolder, MustLetFilesBeCreated) {
  const auto in_proc = check_out_folder("/proc/viscera_out");
  ASSERT_FALSE(in_proc);
  EXPECT_NE(in_proc.error().text().find("--out /proc/viscera_out: "), std::string::npos);
  EXPECT_FALSE(check_out_folder("/proc"));
}

TEST(OutFolder, WithoutPermissionIsRefused) {
  if (geteuid() == 0) GTEST_SKIP() << "root may write everywhere";
  const TemporaryFolder folder;
  chmod(folder.path().c_str(), 0555);
  const auto checked = check_out_folder(folder.path());
  chmod(folder.path().c_str(), 0755);
  ASSERT_FALSE(checked);
  EXPECT_NE(checked.error().text().find("Permission denied"), std::string::npos);
}

}  // namespace
}  // namespace viscera
