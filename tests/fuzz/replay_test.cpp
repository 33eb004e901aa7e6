// The fuzzers' targets, in the ordinary build: their seeds are valid, and what once broke a parser
// (crashes/TARGET/) is read or refused, soon and in little memory.
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <iterator>
#include <set>

#include "tests/fuzz/scratch.h"
#include "tests/fuzz/target.h"

namespace viscera::fuzz {
namespace {

namespace fs = std::filesystem;

struct Named {
  const char* name;
  Target (*target)();
};

#define VISCERA_NAMED(name) Named{#name, name},
const Named kTargets[] = {VISCERA_FUZZ_TARGETS(VISCERA_NAMED)};
#undef VISCERA_NAMED

void PrintTo(const Named& named, std::ostream* out) {
  *out << named.name;
}

/// As the program reads it.
bool reads(const Target& target, const std::string& input) {
  return target.by_child ? target.by_child(input) : target.read(input);
}

/// The most that this process has held [bytes].
long held() {
  rusage usage{};
  ::getrusage(RUSAGE_SELF, &usage);
  return usage.ru_maxrss * 1024;
}

class FuzzTarget : public testing::TestWithParam<Named> {};

TEST_P(FuzzTarget, EverySeedIsRead) {
  const Target target = GetParam().target();
  const std::vector<std::string> seeds = target.seeds();
  EXPECT_FALSE(seeds.empty());
  for (std::size_t number = 0; number < seeds.size(); ++number)
    EXPECT_TRUE(reads(target, seeds[number])) << "seed " << number;
}

TEST_P(FuzzTarget, WhatBrokeItOnceNoLongerDoes) {
  const Target target = GetParam().target();
  std::error_code none;
  const long before = held();
  for (const auto& entry : fs::directory_iterator(
           project_file(std::string("tests/fuzz/crashes/") + GetParam().name), none)) {
    SCOPED_TRACE(entry.path().filename());
    const std::string input = file_text(entry.path());
    const auto begin = std::chrono::steady_clock::now();
    reads(target, input);
    const std::chrono::duration<double> took = std::chrono::steady_clock::now() - begin;
    EXPECT_LT(took.count(), 30.0);  // on a busy machine; a reader has 2 s of its processor
    EXPECT_LT(held() - before, 256 << 20);
  }
}

INSTANTIATE_TEST_SUITE_P(Every, FuzzTarget, testing::ValuesIn(kTargets),
                         [](const auto& one) { return std::string(one.param.name); });

std::set<std::string> target_names() {
  std::set<std::string> names;
  for (const Named& target : kTargets) names.insert(target.name);
  return names;
}

TEST(FuzzTargets, AreTheFilesOfTheirFolder) {
  std::set<std::string> files;
  for (const auto& entry : fs::directory_iterator(project_file("tests/fuzz/targets")))
    if (entry.path().extension() == ".cpp") files.insert(entry.path().stem().string());
  EXPECT_EQ(files, target_names());
}

TEST(FuzzTargets, EachFolderOfCrashesIsOnesAndHasFiles) {
  const std::set<std::string> names = target_names();
  int folders = 0;
  for (const auto& entry : fs::directory_iterator(project_file("tests/fuzz/crashes"))) {
    ++folders;
    const std::string name = entry.path().filename().string();
    EXPECT_TRUE(names.contains(name)) << name << " is no target";
    ASSERT_TRUE(entry.is_directory()) << name;
    const auto is_file = [](const auto& file) { return file.is_regular_file(); };
    EXPECT_TRUE(std::any_of(fs::directory_iterator(entry), fs::directory_iterator(), is_file))
        << name;
  }
  EXPECT_GT(folders, 0);
}

}  // namespace
}  // namespace viscera::fuzz
