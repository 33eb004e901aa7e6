#include "engine/io/interrupt.h"

#include <gtest/gtest.h>

#include <csignal>
#include <thread>

namespace viscera {
namespace {

TEST(Interrupt, RaisesAFlagAndNothingElse) {
  install_interrupt_handler();
  EXPECT_FALSE(interrupted());
  std::raise(SIGINT);
  EXPECT_TRUE(interrupted());
  EXPECT_EQ(interrupt_signal(), SIGINT);
  remove_interrupt_handler();
  EXPECT_FALSE(interrupted());
}

TEST(Interrupt, ListensToATerminationToo) {
  install_interrupt_handler();
  std::raise(SIGTERM);
  EXPECT_EQ(interrupt_signal(), SIGTERM);
  remove_interrupt_handler();
}

TEST(Interrupt, IsRaisedWhereTheTimeIsUpAndNotBefore) {
  install_interrupt_handler();
  interrupt_after(3600.0);
  EXPECT_FALSE(interrupted());
  interrupt_after(0.01);
  while (!interrupted()) std::this_thread::yield();
  EXPECT_EQ(interrupt_signal(), SIGALRM);
  remove_interrupt_handler();
  EXPECT_FALSE(interrupted());
}

TEST(Interrupt, WhoeverComesFirstIsTold) {
  install_interrupt_handler();
  std::raise(SIGINT);
  std::raise(SIGALRM);
  EXPECT_EQ(interrupt_signal(), SIGINT);
  remove_interrupt_handler();
}

TEST(InterruptDeathTest, ASecondSignalEndsTheProcess) {
  testing::FLAGS_gtest_death_test_style = "threadsafe";
  EXPECT_EXIT(
      {
        install_interrupt_handler();
        std::raise(SIGINT);
        std::raise(SIGINT);
        std::exit(0);
      },
      testing::KilledBySignal(SIGINT), "");
}

}  // namespace
}  // namespace viscera
