// The thread that ticks a device on the wall clock, and the figures that it leaves.
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <string>
#include <thread>

#include "haptics/latency_histogram.h"
#include "haptics/servo_tick.h"
#include "haptics/triple_buffer.h"

namespace viscera {

struct ServoLoopSettings {
  /// Slept until this long before the deadline, then spun: a sleeping thread is woken late.
  std::chrono::nanoseconds spin{200'000};
  int priority = 80;        ///< of SCHED_FIFO; 0 doesn't ask for it. The watchdog's is one above
  bool lock_memory = true;  ///< mlockall, so that no tick waits for a page
};

/// Figures of a running or finished loop; any thread may read them.
struct ServoStatistics {
  std::atomic<std::uint64_t> ticks{0}, missed{0};
  std::atomic<std::uint64_t> rests{0};             ///< taken because ticks left others no time
  LatencyHistogram lateness;                       ///< of a tick's start behind its deadline
  LatencyHistogram compute;                        ///< of a whole tick
  std::array<LatencyHistogram, kTickParts> parts;  ///< by TickPart
  std::atomic<double> energy_given{0.0};           ///< [J] net to the hand
  std::atomic<double> greatest_force{0.0};         ///< [N] on the hand
  std::atomic<std::uint64_t> passivity_violations{0};
};

/// One device's loop: its own thread, ticks on a fixed grid of the steady clock. A tick that can't
/// start before the next one is due is missed: the loop skips it, counts it and keeps the grid.
///
/// A second thread is the watchdog. Where no tick has ended for GuardSettings::tick_timeout, it
/// takes the force that the device holds to zero over kWatchdogFade. Ticks that come back find the
/// device let go of, and the tool engages as after a fault.
///
/// Ticks that take all of a processor's time are followed by a rest, so that the rest of the
/// machine lives on, whatever the priority.
///
/// start() and stop() are called by one thread.
class ServoLoop {
 public:
  /// From the force that a stuck tick left to none.
  static constexpr std::chrono::milliseconds kWatchdogFade{50};
  /// stop() takes no longer, but for what the scheduler adds.
  static constexpr std::chrono::milliseconds kLongestStop{200};

  explicit ServoLoop(ServoTick& tick, const ServoLoopSettings& settings = {});
  /// Stops. Waits for a tick that is stuck, for ever if it must: what that tick works on is about
  /// to go. Its device has been let go of by then.
  ~ServoLoop();
  ServoLoop(const ServoLoop&) = delete;
  ServoLoop& operator=(const ServoLoop&) = delete;

  void start();
  /// Lets the force fade, then ends the threads; zero is the last force that is written. True after
  /// at most kLongestStop, whatever device and tissue say. False where a tick doesn't return by
  /// then: its thread can't be ended from outside and lives on, while the watchdog holds the force
  /// at zero (unless it is the device's write() that doesn't return). Call it again to wait for
  /// longer.
  bool stop();

  /// How the thread is scheduled and whether memory is locked, and why not where it isn't. Known
  /// once start() has returned.
  const std::string& scheduler() const { return scheduler_; }
  const ServoStatistics& statistics() const { return statistics_; }
  /// What the last ticks left; one thread reads it (a frame).
  TripleBuffer<ServoOutput>& outputs() { return outputs_; }
  /// What happened; one thread reads it.
  ServoEventRing& events() { return tick_.events(); }
  /// What the watchdog saw; one thread reads it.
  ServoEventRing& watchdog_events() { return watchdog_events_; }

 private:
  using Clock = std::chrono::steady_clock;

  void loop();
  void one_tick(std::uint64_t number);
  void watch();
  void take_force_away(Clock::duration since_tick);

  ServoTick& tick_;
  ServoLoopSettings settings_;
  ServoStatistics statistics_;
  TripleBuffer<ServoOutput> outputs_;
  ServoEventRing watchdog_events_;
  std::string scheduler_;
  std::atomic<bool> ready_{false};
  std::atomic<Clock::time_point> ticked_{};      // when the last tick ended
  std::atomic<Clock::time_point> stop_asked_{};  // 0: not
  std::atomic<bool> loop_ended_{false}, watch_ended_{false};
  bool locked_ = false;
  std::thread thread_, watchdog_;
};

/// The same ticks on the logical clock: as many as are due, on the calling thread.
class LockstepServo {
 public:
  explicit LockstepServo(ServoTick& tick) : tick_(tick) {}
  /// Runs the ticks up to and without `end`.
  void advance_to(std::uint64_t end) {
    for (; state_.next < end; ++state_.next) tick_.run(state_.next);
  }
  std::uint64_t next() const { return state_.next; }

  /// Without that of the tick, which it doesn't own.
  struct State {
    std::uint64_t next = 0;
    static constexpr auto fields() { return std::tuple(field("next", &State::next)); }
  };
  const State& state() const { return state_; }
  void restore(const State& state) { state_ = state; }

 private:
  ServoTick& tick_;
  State state_;
};
static_assert(fields_cover<LockstepServo::State>() && StateOwner<LockstepServo>);

}  // namespace viscera
