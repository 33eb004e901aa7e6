// What each stage took: recorded with a few nanoseconds' work, shown as quantiles in the report and
// as a timeline in Perfetto or chrome://tracing.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "kernels/base/fields.h"
#include "kernels/base/result.h"

namespace viscera {

struct Quantiles {
  std::size_t count = 0;
  double median = 0.0, p99 = 0.0, max = 0.0, total = 0.0;  ///< in the unit of the values
};

/// By nearest rank; zeros for no values.
Quantiles quantiles(std::vector<double> values);

/// The stages of a run on one timeline. One thread only.
class Trace {
 public:
  using Clock = std::chrono::steady_clock;

  /// Times count from here. `stages` names the stages by index, as they stand in the report.
  explicit Trace(std::vector<std::string> stages);

  void add(int stage, std::uint64_t frame, Clock::time_point start, Clock::time_point end);
  /// Room for this many events, so that no frame pays for growth.
  void reserve(std::size_t events) { events_.reserve(events); }

  const std::vector<std::string>& stages() const { return stages_; }
  std::size_t size() const { return events_.size(); }
  struct Event {
    std::int32_t stage;
    std::uint32_t frame;
    std::int64_t start, duration;  ///< [ns] since the trace began
    static constexpr auto fields() {
      return std::tuple(field("stage", &Event::stage), field("frame", &Event::frame),
                        field("start", &Event::start), field("duration", &Event::duration));
    }
  };
  /// In the order in which they ended.
  const std::vector<Event>& events() const { return events_; }
  /// Goes on after events of an earlier process, of which the last has just ended. False where some
  /// are of no stage here; nothing has changed then.
  bool restore(std::vector<Event> events);
  /// Durations of one stage [s].
  Quantiles durations(int stage) const;
  struct Sample {
    std::uint64_t frame = 0;
    double seconds = 0.0;
  };
  /// The same one by one, as they were added.
  std::vector<Sample> samples(int stage) const;

  /// In Chrome's trace format, on one track: a stage that runs inside another nests under it.
  Result<void> write(const std::filesystem::path& file, const std::string& process) const;

 private:
  std::vector<std::string> stages_;
  std::vector<Event> events_;
  Clock::time_point origin_;
};

static_assert(fields_cover<Trace::Event>());

/// Times the scope that it lives in.
class StageTimer {
 public:
  StageTimer(Trace& trace, int stage, std::uint64_t frame)
      : trace_(trace), stage_(stage), frame_(frame), start_(Trace::Clock::now()) {}
  ~StageTimer() { trace_.add(stage_, frame_, start_, Trace::Clock::now()); }
  StageTimer(const StageTimer&) = delete;
  StageTimer& operator=(const StageTimer&) = delete;

 private:
  Trace& trace_;
  int stage_;
  std::uint64_t frame_;
  Trace::Clock::time_point start_;
};

}  // namespace viscera
