#include "kernels/base/aside.h"

#include <gtest/gtest.h>
#include <oneapi/tbb/global_control.h>

#include <array>
#include <atomic>
#include <chrono>
#include <optional>
#include <stdexcept>
#include <thread>

namespace viscera {
namespace {

TEST(Aside, HasDoneAllThatWasBegunWhereWaitEnds) {
  for (const std::size_t threads : {1, 2, 4}) {
    const oneapi::tbb::global_control limit(oneapi::tbb::global_control::max_allowed_parallelism,
                                            threads);
    std::array<int, 20> done{};
    Aside aside;
    for (int& one : done) aside.begin([&one] { ++one; });
    aside.wait();
    for (const int one : done) EXPECT_EQ(one, 1) << threads << " threads";
    aside.begin([&done] { ++done[0]; });
    aside.wait();
    EXPECT_EQ(done[0], 2) << "it goes on after wait()";
  }
}

TEST(Aside, HandsWhatWorkThrewToWhoWaits) {
  Aside aside;
  aside.begin([] { throw std::runtime_error("a torn sheet"); });
  EXPECT_THROW(aside.wait(), std::runtime_error);
  aside.wait();  // once
}

TEST(Aside, EndsItsWorkBeforeItGoes) {
  std::atomic<int> done = 0;
  {
    std::optional<Aside> aside(std::in_place);
    for (int i = 0; i < 4; ++i)
      aside->begin([&done] {
        std::this_thread::sleep_for(std::chrono::milliseconds(5));
        ++done;
      });
    aside->begin([] { throw std::runtime_error("nobody asks any more"); });
  }
  const int ended = done;
  std::this_thread::sleep_for(std::chrono::milliseconds(20));
  EXPECT_EQ(done, ended) << "nothing goes on behind it";
}

}  // namespace
}  // namespace viscera
