#include "kernels/base/task.h"

#include <gtest/gtest.h>

#include <memory>
#include <stdexcept>
#include <string>

namespace viscera {
namespace {

using Numbers = Questions<std::string, int>;

Task<int> sum_of(Numbers& questions, int count) {
  int sum = 0;
  for (int i = 0; i < count; ++i) sum += co_await questions.ask("number " + std::to_string(i));
  co_return sum;
}

Task<int> twice_the_sum(Numbers& questions) {
  const int sum = co_await sum_of(questions, 2);
  co_return 2 * sum;
}

Task<int> refuses(Numbers& questions) {
  const int allowed = co_await questions.ask("may I?");
  if (allowed == 0) throw std::runtime_error("refused");
  co_return allowed;
}

Task<int> goes_on_if_allowed(Numbers& questions) {
  if (const int allowed = co_await refuses(questions); allowed == 0) co_return 2;
  co_return 3;
}

Task<int> keeps(Numbers& questions, std::shared_ptr<int> kept) {
  co_return *kept + co_await questions.ask("how many more?");
}

TEST(Task, BeginsWhenItIsAskedToAndEndsWithItsResult) {
  Numbers questions;
  Task<int> task = sum_of(questions, 0);
  EXPECT_FALSE(task.ended());
  task.begin();
  ASSERT_TRUE(task.ended());
  EXPECT_EQ(task.result(), 0);
}

TEST(Task, StopsAtEachQuestionAndGoesOnWithItsAnswer) {
  Numbers questions;
  Task<int> task = sum_of(questions, 2);
  EXPECT_EQ(questions.open(), nullptr);
  task.begin();
  ASSERT_NE(questions.open(), nullptr);
  EXPECT_EQ(*questions.open(), "number 0");
  questions.answer(3);
  ASSERT_NE(questions.open(), nullptr);
  EXPECT_EQ(*questions.open(), "number 1");
  EXPECT_FALSE(task.ended());
  questions.answer(4);
  EXPECT_EQ(questions.open(), nullptr);
  ASSERT_TRUE(task.ended());
  EXPECT_EQ(task.result(), 7);
}

TEST(Task, AQuestionOfOneThatItWaitsForStopsBoth) {
  Numbers questions;
  Task<int> task = twice_the_sum(questions);
  task.begin();
  questions.answer(1);
  EXPECT_FALSE(task.ended());
  questions.answer(2);
  ASSERT_TRUE(task.ended());
  EXPECT_EQ(task.result(), 6);
}

TEST(Task, WhatItThrewComesOutWithItsResult) {
  Numbers questions;
  Task<int> task = refuses(questions);
  task.begin();
  questions.answer(0);
  ASSERT_TRUE(task.ended());
  EXPECT_THROW(task.result(), std::runtime_error);
}

TEST(Task, WhatOneThatItWaitsForThrewComesOutToo) {
  Numbers questions;
  Task<int> task = goes_on_if_allowed(questions);
  task.begin();
  questions.answer(0);
  ASSERT_TRUE(task.ended());
  EXPECT_THROW(task.result(), std::runtime_error);
  Task<int> allowed = goes_on_if_allowed(questions);
  allowed.begin();
  questions.answer(1);
  EXPECT_EQ(allowed.result(), 3);
}

TEST(Task, OneThatIsNeverAnsweredGivesBackWhatItHolds) {
  auto kept = std::make_shared<int>(1);
  {
    Numbers questions;
    Task<int> task = keeps(questions, kept);
    task.begin();
    EXPECT_GT(kept.use_count(), 1);
  }
  EXPECT_EQ(kept.use_count(), 1);
}

}  // namespace
}  // namespace viscera
