#include "engine/run/stage_clock.h"

namespace viscera {

void StageClock::count(Clock::time_point now) {
  if (open_.empty()) return;
  Sum& sum = sums_[static_cast<std::size_t>(open_.back())];
  sum.spent += now - since_;
  sum.end = now;
  sum.worked = true;
}

void StageClock::enter(RunStage stage) {
  const Clock::time_point now = Clock::now();
  count(now);
  open_.push_back(stage);
  since_ = now;
}

void StageClock::leave() {
  const Clock::time_point now = Clock::now();
  count(now);
  open_.pop_back();
  since_ = now;
}

void StageClock::tell(Trace& trace, std::uint64_t frame) {
  for (std::size_t stage = 0; stage < sums_.size(); ++stage) {
    const Sum& sum = sums_[stage];
    if (sum.worked)
      trace.add(stage_index(static_cast<RunStage>(stage)), frame, sum.end - sum.spent, sum.end);
  }
  sums_ = {};
}

}  // namespace viscera
