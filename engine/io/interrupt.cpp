#include "engine/io/interrupt.h"

#include <atomic>
#include <csignal>

namespace viscera {
namespace {

std::atomic<int> received = 0;
static_assert(std::atomic<int>::is_always_lock_free, "a signal handler may not wait");

extern "C" void on_signal(int signal) {
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
}

}  // namespace

void install_interrupt_handler() {
  received = 0;
  handle(on_signal);
}

void remove_interrupt_handler() {
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
