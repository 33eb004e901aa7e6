#include "haptics/realtime.h"

#include <fmt/format.h>
#include <pthread.h>
#include <sched.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <mutex>

namespace viscera {
namespace {

// Pages are the process's: several loops share one lock.
std::mutex holders_mutex;
int holders = 0;

}  // namespace

std::string ask_for_fifo(int priority) {
  // Without it, Linux may wake an ordinary thread 50 us late to save power.
  prctl(PR_SET_TIMERSLACK, 1UL);
  if (priority <= 0) return "SCHED_OTHER (SCHED_FIFO not asked for)";
  sched_param parameters{};
  parameters.sched_priority = priority;
  const int refused = pthread_setschedparam(pthread_self(), SCHED_FIFO, &parameters);
  if (refused == 0) return fmt::format("SCHED_FIFO {}", priority);
  return fmt::format("SCHED_OTHER (SCHED_FIFO refused: {})", std::strerror(refused));
}

std::string lock_memory(bool& locked) {
  locked = false;
  rlimit limit{};
  getrlimit(RLIMIT_MEMLOCK, &limit);
  // Under a limit, locked future pages would make the rest of the program run out of memory.
  if (limit.rlim_cur != RLIM_INFINITY && geteuid() != 0) {
    return fmt::format("memory not locked (ulimit -l allows {} KiB, expected unlimited)",
                       limit.rlim_cur / 1024);
  }
  const std::lock_guard lock(holders_mutex);
  if (holders == 0 && mlockall(MCL_CURRENT | MCL_FUTURE | MCL_ONFAULT) != 0)
    return fmt::format("memory not locked ({})", std::strerror(errno));
  ++holders;
  locked = true;
  return "memory locked";
}

void unlock_memory() {
  const std::lock_guard lock(holders_mutex);
  if (--holders == 0) munlockall();
}

void touch_stack() {
  constexpr std::size_t kBytes = 256 * 1024, kPage = 4096;
  volatile char stack[kBytes];
  for (std::size_t i = 0; i < kBytes; i += kPage) stack[i] = 0;
  static_cast<void>(stack[0]);
}

}  // namespace viscera
