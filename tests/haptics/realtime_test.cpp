#include "haptics/realtime.h"

#include <gtest/gtest.h>
#include <pthread.h>

#include <thread>

namespace viscera {
namespace {

TEST(Realtime, WhatItSaysOfTheSchedulerIsWhatTheKernelSays) {
  for (const int priority : {0, 1}) {
    std::string words;
    int policy = -1;
    sched_param parameters{};
    std::thread([&] {
      words = ask_for_fifo(priority);
      pthread_getschedparam(pthread_self(), &policy, &parameters);
    }).join();
    EXPECT_EQ(words.starts_with("SCHED_FIFO"), policy == SCHED_FIFO) << words;
    EXPECT_TRUE(policy != SCHED_FIFO || words == "SCHED_FIFO 1") << words;
    EXPECT_EQ(words == "SCHED_OTHER (SCHED_FIFO not asked for)", priority == 0) << words;
  }
}

}  // namespace
}  // namespace viscera
