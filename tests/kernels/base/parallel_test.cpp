#include "kernels/base/parallel.h"

#include <gtest/gtest.h>
#include <oneapi/tbb/global_control.h>
#include <oneapi/tbb/task_arena.h>

#include <atomic>
#include <cmath>
#include <numeric>
#include <vector>

namespace viscera {
namespace {

constexpr std::size_t kCount = 100'003;  // not a multiple of the chunk
constexpr std::size_t kChunk = 257;

/// Numbers of both signs and sizes from 1e-8 to 1e8: their sum depends on the order.
double awkward(std::size_t i) {
  const double x = static_cast<double>(i);
  return std::sin(1.7 * x) * std::pow(10.0, static_cast<double>(i % 17) - 8.0);
}

double sum_of(std::size_t begin, std::size_t end) {
  double sum = 0.0;
  for (std::size_t i = begin; i < end; ++i) sum += awkward(i);
  return sum;
}

double parallel_sum_on(int threads) {
  using oneapi::tbb::global_control;
  const global_control most(global_control::max_allowed_parallelism,
                            static_cast<std::size_t>(threads));
  oneapi::tbb::task_arena arena(threads);
  return arena.execute([] { return parallel_sum<double>(kCount, kChunk, 0.0, sum_of); });
}

TEST(Parallel, SumsAreTheSameBitsOnAnyNumberOfThreads) {
  double expected = 0.0;  // chunk by chunk, in order
  for (std::size_t i = 0; i < kCount; i += kChunk)
    expected += sum_of(i, std::min(kCount, i + kChunk));
  ASSERT_NE(expected, sum_of(0, kCount)) << "the order makes no difference to these numbers";
  for (const int threads : {1, 2, 3, 4, 8}) {
    for (int repeat = 0; repeat < 5; ++repeat)
      EXPECT_EQ(parallel_sum_on(threads), expected) << threads << " threads";
  }
}

TEST(Parallel, EveryIndexIsVisitedOnce) {
  std::vector<std::atomic<int>> visits(kCount);
  parallel_for_each_index(kCount, kChunk, [&](std::size_t i) { ++visits[i]; });
  for (std::size_t i = 0; i < kCount; ++i) ASSERT_EQ(visits[i], 1) << i;
}

TEST(Parallel, ChunksBeginAtMultiplesAndTheLastIsCut) {
  std::vector<std::size_t> ends(4);
  parallel_chunks(35, 10, [&](std::size_t begin, std::size_t end) {
    ASSERT_EQ(begin % 10, 0u);
    ends[begin / 10] = end;
  });
  EXPECT_EQ(ends, (std::vector<std::size_t>{10, 20, 30, 35}));
}

TEST(Parallel, NothingIsSummedToTheStartValue) {
  const auto never = [](std::size_t, std::size_t) -> double { return NAN; };
  EXPECT_EQ(parallel_sum<double>(0, kChunk, 3.5, never), 3.5);
  parallel_for_each_index(0, kChunk, [](std::size_t) { FAIL(); });
}

}  // namespace
}  // namespace viscera
