// What each stage takes where one asks for another's result in the middle of its own work.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "engine/io/trace.h"
#include "engine/simulator/build.h"

namespace viscera {

/// Counts every moment for the innermost stage alone. One thread.
class StageClock {
 public:
  using Clock = Trace::Clock;

  class Scope {
   public:
    Scope(StageClock& clock, RunStage stage) : clock_(clock) { clock_.enter(stage); }
    ~Scope() { clock_.leave(); }
    Scope(const Scope&) = delete;
    Scope& operator=(const Scope&) = delete;

   private:
    StageClock& clock_;
  };

  /// One event for each stage that has worked since the last call, ending when it last did.
  void tell(Trace& trace, std::uint64_t frame);

 private:
  struct Sum {
    Clock::duration spent{};
    Clock::time_point end;
    bool worked = false;
  };
  void enter(RunStage stage);
  void leave();
  void count(Clock::time_point now);

  std::vector<RunStage> open_;  ///< innermost last
  Clock::time_point since_;
  std::array<Sum, kRunStageNames.size()> sums_;
};

}  // namespace viscera
