// Times every stage of every frame: a few nanoseconds a stage, one append a call.
#pragma once

#include <chrono>
#include <cstdint>
#include <vector>

#include "engine/stages.h"

namespace viscera {

class StageClock {
 public:
  struct Event {
    Stage stage;
    std::uint64_t frame;
    double start_us;      ///< since the clock was made
    double duration_us;
  };

  /// Times from its making to its end.
  class Scope {
   public:
    Scope(StageClock& clock, Stage stage) : clock_(clock), stage_(stage), start_(now()) {}
    ~Scope() { clock_.record(stage_, start_, now()); }
    Scope(const Scope&) = delete;
    Scope& operator=(const Scope&) = delete;

   private:
    StageClock& clock_;
    Stage stage_;
    std::chrono::steady_clock::time_point start_;
  };

  void begin_frame(std::uint64_t frame) { frame_ = frame; }
  Scope measure(Stage stage) { return Scope(*this, stage); }
  const std::vector<Event>& events() const { return events_; }

 private:
  static std::chrono::steady_clock::time_point now() { return std::chrono::steady_clock::now(); }
  void record(Stage stage, std::chrono::steady_clock::time_point start,
              std::chrono::steady_clock::time_point end) {
    using Microseconds = std::chrono::duration<double, std::micro>;
    events_.push_back({stage, frame_, Microseconds(start - origin_).count(),
                       Microseconds(end - start).count()});
  }

  std::chrono::steady_clock::time_point origin_ = now();
  std::uint64_t frame_ = 0;
  std::vector<Event> events_;
};

}  // namespace viscera
