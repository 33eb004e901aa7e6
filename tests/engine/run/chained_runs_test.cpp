// Whole runs one after another in one process, as a program that makes many would start them.
#include <gtest/gtest.h>
#include <malloc.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>

#include "engine/run/run.h"
#include "kernels/base/sanitized.h"
#include "tests/engine/run/watched_run.h"
#include "tests/support/paths.h"
#include "tests/support/small_world.h"

namespace viscera::test {
namespace {

/// Resident now [bytes], without what the heap keeps free: how much that is depends on which thread
/// gave back what.
double resident() {
  ::malloc_trim(0);
  std::ifstream file("/proc/self/statm");
  double all = 0.0, here = 0.0;
  file >> all >> here;
  return here * static_cast<double>(::sysconf(_SC_PAGESIZE));
}

/// Asked for and not given back [bytes], of all of the heap's arenas.
double in_use() {
  const struct mallinfo2 heap = ::mallinfo2();
  return static_cast<double>(heap.uordblks + heap.hblkhd);
}

/// The greatest seen.
struct Memory {
  double resident = 0.0, in_use = 0.0;

  void see() {
    resident = std::max(resident, test::resident());
    in_use = std::max(in_use, test::in_use());
  }
};

/// Open now.
std::ptrdiff_t descriptors() {
  const std::filesystem::directory_iterator open("/proc/self/fd");
  return std::distance(begin(open), end(open));
}

TEST(ChainedRuns, AHundredKeepTheirMemoryWithinOnePercentAndNoFileOpen) {
#ifdef VISCERA_SANITIZED
  GTEST_SKIP() << "a sanitizer keeps the heap";
#endif
  constexpr int kRuns = 100, kFirst = 20;  // until when libraries keep more to themselves
  constexpr int kHalf = (kFirst + kRuns) / 2;
  SceneDescription scene = watched_scene();
  scene.duration = 0.2;
  const auto tissues = test_tissues();
  Memory first, last;  // the greatest of the settled runs' halves
  std::ptrdiff_t open = 0;
  std::string hash;
  for (int run = 1; run <= kRuns; ++run) {
    const TemporaryFolder folder;
    RunOptions options;
    options.out = folder / "out";
    options.assets = project_file("assets");
    options.render = false;
    options.use_cache = false;
    options.quiet = true;
    options.threads = 1;  // of several, each keeps room of its own when work first comes to it
    const auto report = run_scene(scene, tissues, options);
    ASSERT_TRUE(report) << report.error().text();
    ASSERT_TRUE(report->complete) << run;
    if (run == 1) hash = report->state_hash;
    ASSERT_EQ(report->state_hash, hash) << run;
    if (run == kFirst) open = descriptors();
    if (run > kFirst) (run <= kHalf ? first : last).see();
    if (run % 20 == 0) {
      RecordProperty("resident_" + std::to_string(run), std::to_string(resident()));
      RecordProperty("in_use_" + std::to_string(run), std::to_string(in_use()));
    }
  }
  EXPECT_LT(last.in_use, 1.01 * first.in_use);
  EXPECT_LT(last.resident, 1.01 * first.resident);
  EXPECT_EQ(descriptors(), open);
}

}  // namespace
}  // namespace viscera::test
