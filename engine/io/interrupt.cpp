#include "engine/io/interrupt.h"

#include <sys/time.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <csignal>

namespace viscera {
namespace {

std::atomic<int> received = 0;
static_assert(std::atomic<int>::is_always_lock_free, "a signal handler may not wait");

extern "C" void on_signal(int signal) {
  int none = 0;
  if (signal == SIGALRM) {
    received.compare_exchange_strong(none, signal);
    return;
  }
  if (received.exchange(signal) != 0) {
    // The work didn't stop in time for whoever sent the second one.
    std::signal(signal, SIG_DFL);
    std::raise(signal);
  }
}

void handle(void (*handler)(int)) {
  struct sigaction action = {};
  action.sa_handler = handler;
  action.sa_flags = SA_RESTART;  // writes in progress go on
  sigemptyset(&action.sa_mask);
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
  sigaction(SIGHUP, &action, nullptr);
  sigaction(SIGALRM, &action, nullptr);
}

void set_alarm(double seconds) {
  itimerval timer = {};
  timer.it_value.tv_sec = static_cast<time_t>(seconds);
  timer.it_value.tv_usec = static_cast<suseconds_t>(1e6 * (seconds - std::floor(seconds)));
  setitimer(ITIMER_REAL, &timer, nullptr);
}

}  // namespace

void install_interrupt_handler() {
  received = 0;
  handle(on_signal);
}

void interrupt_after(double seconds) {
  set_alarm(std::max(seconds, 1e-3));
}

void remove_interrupt_handler() {
  set_alarm(0.0);
  handle(SIG_DFL);
  received = 0;
}

bool interrupted() {
  return received.load(std::memory_order_relaxed) != 0;
}
Progress until_interrupted() {
  return [](double, std::string_view) { return !interrupted(); };
}
int interrupt_signal() {
  return received.load(std::memory_order_relaxed);
}

}  // namespace viscera
