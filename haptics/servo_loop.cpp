#include "haptics/servo_loop.h"

#include <algorithm>

#include "haptics/realtime.h"

namespace viscera {

namespace {

using namespace std::chrono_literals;

/// After stop(), ticks have so long to let the force fade; then the watchdog does it.
constexpr auto kLongestFade = 100ms;
/// The watchdog looks this often, and says after so long that a tick is stuck.
constexpr auto kWatch = 2ms, kStuck = 150ms;
/// A loop that hasn't slept for so long rests after each tick: a quarter of what the tick took, but
/// within a quarter of a period and kLongestRest.
constexpr auto kLongestBusy = 50ms;
constexpr auto kLongestRest = 5ms;

}  // namespace

ServoLoop::ServoLoop(ServoTick& tick, const ServoLoopSettings& settings)
    : tick_(tick), settings_(settings) {}

ServoLoop::~ServoLoop() {
  while (!stop()) {
  }
}

void ServoLoop::start() {
  if (thread_.joinable()) return;
  ready_ = false;
  stop_asked_ = Clock::time_point();
  loop_ended_ = watch_ended_ = false;
  tick_.pen().give_back();
  thread_ = std::thread([this] { loop(); });
  ready_.wait(false);
  watchdog_ = std::thread([this] { watch(); });
}

bool ServoLoop::stop() {
  if (!thread_.joinable()) return true;
  const Clock::time_point now = Clock::now();
  if (stop_asked_.load() == Clock::time_point()) stop_asked_ = now;
  while (!watch_ended_ && Clock::now() < now + kLongestStop) std::this_thread::sleep_for(1ms);
  if (!watch_ended_) return false;
  thread_.join();
  watchdog_.join();
  tick_.forget_force();
  if (locked_) unlock_memory();
  locked_ = false;
  return true;
}

/// From the force that the device holds to none, where no tick is in the middle of a write.
void ServoLoop::take_force_away(Clock::duration since_tick) {
  DevicePen& pen = tick_.pen();
  if (!pen.take()) return;
  if (since_tick > Clock::duration::zero())
    watchdog_events_.push(
        {0, ServoEventKind::kWatchdog, std::chrono::duration<double>(since_tick).count()});
  const Clock::time_point began = Clock::now();
  double share = pen.held().isZero(0.0) ? 0.0 : 1.0;
  while (share > 0.0) {
    pen.fade_to(share);
    std::this_thread::sleep_for(1ms);
    share = 1.0 - std::chrono::duration<double>(Clock::now() - began) / kWatchdogFade;
  }
  pen.let_go();
}

void ServoLoop::watch() {
  ask_for_fifo(settings_.priority > 0 ? std::min(settings_.priority + 1, 99) : 0);
  const auto timeout = std::chrono::duration<double>(tick_.settings().guard.tick_timeout);
  bool told = false;
  while (!loop_ended_) {
    std::this_thread::sleep_for(kWatch);
    const Clock::time_point asked = stop_asked_, ticked = ticked_, now = Clock::now();
    if (!told && asked != Clock::time_point() && now - asked > kStuck && !loop_ended_) {
      watchdog_events_.push({0, ServoEventKind::kTickStuck, 0.0});
      told = true;
    }
    if (now - ticked > timeout) take_force_away(now - ticked);
  }
  take_force_away({});
  watch_ended_ = true;
}

void ServoLoop::one_tick(std::uint64_t number) {
  TickTimes times;
  const ServoOutput& output = tick_.run(number, &times);
  std::uint64_t all = 0;
  for (std::size_t part = 0; part < kTickParts; ++part) {
    statistics_.parts[part].add(times[part]);
    all += times[part];
  }
  statistics_.compute.add(all);
  statistics_.energy_given.store(tick_.energy_given(), std::memory_order_relaxed);
  statistics_.greatest_force.store(tick_.greatest_force(), std::memory_order_relaxed);
  statistics_.passivity_violations.store(tick_.passivity_violations(), std::memory_order_relaxed);
  statistics_.ticks.fetch_add(1, std::memory_order_relaxed);
  outputs_.back() = output;
  outputs_.publish();
}

void ServoLoop::loop() {
  scheduler_ = ask_for_fifo(settings_.priority) + ", " +
               (settings_.lock_memory ? lock_memory(locked_)
                                      : std::string("memory not locked (not asked for)"));
  touch_stack();
  ticked_ = Clock::now();
  ready_ = true;
  ready_.notify_all();

  const auto period = std::chrono::duration_cast<Clock::duration>(
      std::chrono::duration<double>(tick_.settings().dt));
  std::uint64_t number = tick_.output().tick + 1;  // goes on where an earlier start() ended
  Clock::time_point now = Clock::now(), rested = now, deadline = now + period;
  Clock::duration took{};
  bool told = false;
  while (true) {
    now = Clock::now();
    if (now < deadline - settings_.spin) {
      std::this_thread::sleep_until(deadline - settings_.spin);
      rested = Clock::now();
    } else if (now - rested > kLongestBusy) {
      if (!told)
        tick_.events().push({number, ServoEventKind::kAlwaysLate,
                             std::chrono::duration<double>(now - rested).count()});
      told = true;
      statistics_.rests.fetch_add(1, std::memory_order_relaxed);
      std::this_thread::sleep_for(std::clamp<Clock::duration>(took / 4, period / 4, kLongestRest));
    }
    now = Clock::now();
    while (now < deadline) now = Clock::now();
    if (const Clock::time_point asked = stop_asked_; asked != Clock::time_point()) {
      tick_.release();
      const bool let_go = tick_.released() && tick_.output().force.isZero(0.0);
      if (let_go || now - asked > kLongestFade) break;
    }
    const Clock::duration late = now - deadline;
    statistics_.lateness.add(static_cast<std::uint64_t>(
        std::chrono::duration_cast<std::chrono::nanoseconds>(late).count()));
    if (const auto skipped = late / period; skipped > 0) {
      statistics_.missed.fetch_add(static_cast<std::uint64_t>(skipped), std::memory_order_relaxed);
      number += static_cast<std::uint64_t>(skipped);
      deadline += skipped * period;
    }
    one_tick(number++);
    took = Clock::now() - now;
    ticked_ = now + took;
    deadline += period;
  }
  loop_ended_ = true;
}

}  // namespace viscera
