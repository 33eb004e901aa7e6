#include "engine/io/file_worker.h"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <new>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

namespace viscera {
namespace {

using namespace std::chrono_literals;

/// Jobs wait at it until it is opened.
class Gate {
 public:
  Result<void> pass() const {
    open_.wait(false);
    return {};
  }
  void open() {
    open_ = true;
    open_.notify_all();
  }

 private:
  std::atomic<bool> open_ = false;
};

TEST(FileWorker, JobsRunInTheirOrderOnAThreadOfTheirOwn) {
  FileWorker worker;
  std::vector<int> order;
  std::thread::id thread;
  for (int i = 0; i < 20; ++i)
    worker.add([&, i] {
      order.push_back(i);
      thread = std::this_thread::get_id();
      return Result<void>();
    });
  ASSERT_TRUE(worker.finish());
  ASSERT_EQ(order.size(), 20u);
  for (int i = 0; i < 20; ++i) EXPECT_EQ(order[static_cast<std::size_t>(i)], i);
  EXPECT_NE(thread, std::this_thread::get_id());
  EXPECT_EQ(worker.done(), 20);
}

TEST(FileWorker, TheQueueIsBoundedAndTheCallerWaitsOnlyForRoom) {
  Gate gate;
  FileWorker worker(2);
  std::atomic<int> added = 0;
  std::thread caller([&] {
    for (int i = 0; i < 4; ++i) {
      worker.add([&] { return gate.pass(); });
      ++added;
    }
  });
  // One runs, two wait; the fourth has no room while the gate is shut.
  for (int i = 0; i < 20'000 && added < 3; ++i) std::this_thread::sleep_for(1ms);
  std::this_thread::sleep_for(20ms);
  EXPECT_EQ(added, 3);
  gate.open();
  caller.join();
  EXPECT_TRUE(worker.finish());
  EXPECT_EQ(worker.done(), 4);
}

TEST(FileWorker, TheFirstFailureIsKeptAndLaterJobsRunAllTheSame) {
  FileWorker worker;
  EXPECT_TRUE(worker.status());
  worker.add([]() -> Result<void> { return failure("first"); });
  worker.add([]() -> Result<void> { return failure("second"); });
  worker.add([] { return Result<void>(); });
  const Result<void> finished = worker.finish();
  ASSERT_FALSE(finished);
  EXPECT_EQ(finished.error().text(), "first");
  ASSERT_FALSE(worker.status());
  EXPECT_EQ(worker.status().error().text(), "first");
  EXPECT_EQ(worker.done(), 1);
}

TEST(FileWorker, StatusDoesNotWaitForWhatIsQueued) {
  Gate gate;
  FileWorker worker;
  worker.add([&] { return gate.pass(); });
  EXPECT_TRUE(worker.status());
  EXPECT_EQ(worker.done(), 0);
  gate.open();
  EXPECT_TRUE(worker.finish());
}

TEST(FileWorker, AnExceptionIsAFailureOfThatFileAlone) {
  FileWorker worker;
  worker.add([]() -> Result<void> { throw std::bad_alloc(); });
  worker.add([]() -> Result<void> { throw std::runtime_error("torn"); });
  worker.add([] { return Result<void>(); });
  const Result<void> finished = worker.finish();
  ASSERT_FALSE(finished);
  EXPECT_NE(finished.error().text().find("out of memory"), std::string::npos);
  EXPECT_EQ(worker.done(), 1);
}

TEST(FileWorker, ItsEndWaitsForWhatIsQueued) {
  std::atomic<int> ran = 0;
  {
    FileWorker worker(8);
    for (int i = 0; i < 8; ++i)
      worker.add([&] {
        std::this_thread::sleep_for(2ms);
        ++ran;
        return Result<void>();
      });
  }
  EXPECT_EQ(ran, 8);
}

TEST(FileWorker, TellsHowLongItsJobsTook) {
  FileWorker worker;
  EXPECT_EQ(worker.seconds(), 0.0);
  worker.add([] {
    std::this_thread::sleep_for(20ms);
    return Result<void>();
  });
  ASSERT_TRUE(worker.finish());
  EXPECT_GE(worker.seconds(), 0.02);
}

}  // namespace
}  // namespace viscera
