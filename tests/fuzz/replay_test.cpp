// The fuzzers' targets, in the ordinary build: their seeds are valid, and what once broke a parser
// (crashes/TARGET/) is read or refused, soon and in little memory.
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <chrono>
#include <filesystem>

#include "tests/fuzz/scratch.h"
#include "tests/fuzz/target.h"

namespace viscera::fuzz {
namespace {

namespace fs = std::filesystem;

struct Named {
  const char* name;
  Target (*target)();
};

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
  int number = 0;
  for (const std::string& seed : target.seeds())
    EXPECT_TRUE(reads(target, seed)) << "seed " << number++;
}

TEST_P(FuzzTarget, WhatBrokeItOnceNoLongerDoes) {
  const Target target = GetParam().target();
  std::error_code none;
  const long before = held();
  for (const auto& entry : fs::directory_iterator(
           project_file(std::string("tests/fuzz/crashes/") + GetParam().name), none)) {
    SCOPED_TRACE(entry.path().filename());
    const std::string input = bytes_of_file(entry.path());
    const auto begin = std::chrono::steady_clock::now();
    reads(target, input);
    const std::chrono::duration<double> took = std::chrono::steady_clock::now() - begin;
    EXPECT_LT(took.count(), 30.0);  // on a busy machine; a reader has 2 s of its processor
    EXPECT_LT(held() - before, 256 << 20);
  }
}

#define VISCERA_TARGET(name) \
  Named {                    \
#name, name              \
  }
INSTANTIATE_TEST_SUITE_P(
    Every, FuzzTarget,
    testing::Values(VISCERA_TARGET(archive), VISCERA_TARGET(cache), VISCERA_TARGET(checkpoint),
                    VISCERA_TARGET(controls), VISCERA_TARGET(gltf), VISCERA_TARGET(igtl),
                    VISCERA_TARGET(json), VISCERA_TARGET(nifti), VISCERA_TARGET(nrrd),
                    VISCERA_TARGET(obj), VISCERA_TARGET(ply), VISCERA_TARGET(recording),
                    VISCERA_TARGET(scene), VISCERA_TARGET(sealed), VISCERA_TARGET(set),
                    VISCERA_TARGET(stl), VISCERA_TARGET(vdb)),
    [](const auto& one) { return std::string(one.param.name); });
#undef VISCERA_TARGET

}  // namespace
}  // namespace viscera::fuzz
