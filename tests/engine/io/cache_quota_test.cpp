#include "engine/io/cache_quota.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <string>

#include "tests/engine/io/file_text.h"
#include "tests/support/paths.h"

namespace viscera {
namespace {

namespace fs = std::filesystem;
using test::put_text;
using test::TemporaryFolder;

constexpr std::time_t kNow = 2'000'000'000;

/// KEY of 32 digits that ends with this one.
std::string key(char last) {
  return std::string(31, '0') + last;
}

/// A file of 1,000 bytes that was used so many seconds ago.
void put(const fs::path& file, std::time_t ago) {
  put_text(file, std::string(1000, 'x'));
  const timespec times[2] = {{kNow - ago, 0}, {kNow - ago, 0}};
  ASSERT_EQ(utimensat(AT_FDCWD, file.c_str(), times, 0), 0);
}

TEST(CacheQuota, ForgetsTheLeastRecentlyUsedUntilTheRestFits) {
  const TemporaryFolder folder;
  put(folder / (key('a') + ".h5"), 3000);
  put(folder / (key('b') + ".shape"), 9000);
  put(folder / (key('c') + ".h5"), 6000);
  forget_least_used(folder.path(), 2000, kNow);
  EXPECT_TRUE(fs::exists(folder / (key('a') + ".h5")));
  EXPECT_FALSE(fs::exists(folder / (key('b') + ".shape")));
  EXPECT_TRUE(fs::exists(folder / (key('c') + ".h5")));
  forget_least_used(folder.path(), 1999, kNow);
  EXPECT_TRUE(fs::exists(folder / (key('a') + ".h5")));
  EXPECT_FALSE(fs::exists(folder / (key('c') + ".h5")));
}

TEST(CacheQuota, AnOrgansFactorIsAsFreshAsTheOrganAndGoesWithIt) {
  const TemporaryFolder folder;
  put(folder / (key('a') + ".factor"), 9000);  // written once
  put(folder / (key('a') + ".h5"), 100);       // used since
  put(folder / (key('b') + ".h5"), 5000);
  put(folder / (key('b') + ".factor"), 5000);
  forget_least_used(folder.path(), 2000, kNow);
  EXPECT_EQ(test::entries(folder.path()), 2);
  EXPECT_TRUE(fs::exists(folder / (key('a') + ".factor")));
  EXPECT_TRUE(fs::exists(folder / (key('a') + ".h5")));
}

TEST(CacheQuota, WhatWasUsedWithinAMinuteStaysWhateverTheQuota) {
  const TemporaryFolder folder;
  put(folder / (key('a') + ".h5"), 59);
  put(folder / (key('b') + ".h5"), 60);
  forget_least_used(folder.path(), 0, kNow);
  EXPECT_TRUE(fs::exists(folder / (key('a') + ".h5")));
  EXPECT_FALSE(fs::exists(folder / (key('b') + ".h5")));
}

TEST(CacheQuota, AReadEntryIsTheFreshest) {
  const TemporaryFolder folder;
  const fs::path file = folder / (key('a') + ".h5");
  put(file, 3000);
  struct stat before = {}, after = {};
  ASSERT_EQ(stat(file.c_str(), &before), 0);
  const std::time_t begun = std::time(nullptr);
  mark_used(file);
  const std::time_t ended = std::time(nullptr);
  ASSERT_EQ(stat(file.c_str(), &after), 0);
  EXPECT_EQ(before.st_mtime, kNow - 3000);
  // File systems keep a time to within two seconds.
  EXPECT_GE(after.st_mtime, begun - 2);
  EXPECT_LE(after.st_mtime, ended + 2);
}

TEST(CacheQuota, TouchesNothingThatTheCacheHasntWritten) {
  const TemporaryFolder folder;
  fs::create_directories(folder / (key('d') + ".h5"));
  const std::vector<std::string> others = {"notes.txt",       "liver.h5",        key('g') + ".h5",
                                           key('a') + ".csv", "mine.h5.1-2.tmp", "a.tmp"};
  for (const std::string& name : others) put(folder / name, 900'000);
  put(folder / "outside", 900'000);
  fs::create_symlink(folder / "outside", folder / (key('e') + ".h5"));
  forget_least_used(folder.path(), 0, kNow);
  for (const std::string& name : others) EXPECT_TRUE(fs::exists(folder / name)) << name;
  EXPECT_TRUE(fs::is_directory(folder / (key('d') + ".h5")));
  EXPECT_TRUE(fs::is_symlink(folder / (key('e') + ".h5")));
}

TEST(CacheQuota, WhatAKilledProcessHasBegunGoesAndWhatALivingOneWritesStays) {
  const TemporaryFolder folder;
  const pid_t gone = fork();
  if (gone == 0) _exit(0);
  waitpid(gone, nullptr, 0);
  const auto begun = [&](pid_t process) {
    return folder / (key('a') + ".h5." + std::to_string(process) + "-0.tmp");
  };
  put(begun(gone), 5);
  put(begun(getpid()), 5);
  const fs::path forgotten = folder / (key('b') + ".shape." + std::to_string(getpid()) + "-1.tmp");
  put(forgotten, 90'000);
  forget_least_used(folder.path(), 1'000'000, kNow);
  EXPECT_FALSE(fs::exists(begun(gone)));
  EXPECT_TRUE(fs::exists(begun(getpid())));
  EXPECT_FALSE(fs::exists(forgotten)) << "older than a day";
}

TEST(CacheQuota, AFolderThatIsntThereIsNoMistake) {
  forget_least_used("/nowhere/at/all", 0, kNow);
}

TEST(CacheQuota, IsASettingOfTheEnvironment) {
  const auto asked = [](const char* value) {
    value ? setenv("VISCERA_CACHE_GB", value, 1) : unsetenv("VISCERA_CACHE_GB");
    CacheQuota quota = cache_quota();
    unsetenv("VISCERA_CACHE_GB");
    return quota;
  };
  EXPECT_EQ(asked(nullptr).bytes, 5'000'000'000u);
  EXPECT_EQ(asked("").bytes, 5'000'000'000u);
  EXPECT_EQ(asked("0").bytes, 0u);
  EXPECT_EQ(asked("0.25").bytes, 250'000'000u);
  EXPECT_EQ(asked("0.25").warning, "");
  for (const char* wrong : {"-1", "nan", "inf", "5 GB", "many", "1e9"}) {
    EXPECT_EQ(asked(wrong).bytes, 5'000'000'000u) << wrong;
    EXPECT_NE(asked(wrong).warning.find(wrong), std::string::npos) << wrong;
  }
}

}  // namespace
}  // namespace viscera
