#include "engine/run/stage_clock.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <thread>

#include "engine/simulator/build.h"

namespace viscera {
namespace {

void work() {
  std::this_thread::sleep_for(std::chrono::milliseconds(20));
}

double spent(const Trace& trace, RunStage stage) {
  return trace.durations(stage_index(stage)).total;
}

TEST(StageClock, EachStageCountsItsOwnWorkAlone) {
  Trace trace(stage_names());
  StageClock clock;
  const auto begun = StageClock::Clock::now();
  {
    const StageClock::Scope encode(clock, RunStage::kEncode);
    {
      const StageClock::Scope draw(clock, RunStage::kDraw);
      { const StageClock::Scope splat(clock, RunStage::kSplatSmoke); }
      work();
      work();
    }
    work();
  }
  const double all = std::chrono::duration<double>(StageClock::Clock::now() - begun).count();
  clock.tell(trace, 7);
  EXPECT_GE(spent(trace, RunStage::kDraw), 0.04);
  EXPECT_GE(spent(trace, RunStage::kEncode), 0.02);
  EXPECT_LE(spent(trace, RunStage::kDraw) + spent(trace, RunStage::kEncode) +
                spent(trace, RunStage::kSplatSmoke),
            all);
}

TEST(StageClock, TellsOneEventAStageHoweverOftenItWorked) {
  Trace trace(stage_names());
  StageClock clock;
  for (int i = 0; i < 3; ++i) {
    const StageClock::Scope scope(clock, RunStage::kEncode);
  }
  clock.tell(trace, 4);
  clock.tell(trace, 6);
  ASSERT_EQ(trace.size(), 1u);
  EXPECT_EQ(trace.events()[0].stage, stage_index(RunStage::kEncode));
  EXPECT_EQ(trace.events()[0].frame, 4u);
}

}  // namespace
}  // namespace viscera
