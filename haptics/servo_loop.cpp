#include "haptics/servo_loop.h"

#include <algorithm>

#include "haptics/realtime.h"

namespace viscera {

using Clock = std::chrono::steady_clock;

ServoLoop::ServoLoop(ServoTick& tick, const ServoLoopSettings& settings)
    : tick_(tick), settings_(settings) {}

ServoLoop::~ServoLoop() {
  stop();
}

void ServoLoop::start() {
  if (thread_.joinable()) return;
  ready_ = false;
  stop_ = false;
  thread_ = std::thread([this] { loop(); });
  ready_.wait(false);
}

void ServoLoop::stop() {
  if (!thread_.joinable()) return;
  stop_ = true;
  thread_.join();
  if (locked_) unlock_memory();
  locked_ = false;
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
  ready_ = true;
  ready_.notify_all();

  const auto period = std::chrono::duration_cast<Clock::duration>(
      std::chrono::duration<double>(tick_.settings().dt));
  std::uint64_t number = tick_.output().tick + 1;  // goes on where an earlier start() ended
  Clock::time_point deadline = Clock::now() + period;
  while (true) {
    std::this_thread::sleep_until(deadline - settings_.spin);
    Clock::time_point now = Clock::now();
    while (now < deadline) now = Clock::now();
    if (stop_.load(std::memory_order_relaxed)) {
      tick_.release();
      if (tick_.released() && tick_.output().force.isZero()) break;
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
    deadline += period;
  }
}

}  // namespace viscera
