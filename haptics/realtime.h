// What a thread with deadlines asks of the operating system.
#pragma once

#include <string>

namespace viscera {

/// Asks SCHED_FIFO for the calling thread; says what it got: "SCHED_FIFO 80", or
/// "SCHED_OTHER (SCHED_FIFO refused: Operation not permitted)".
std::string ask_for_fifo(int priority);

/// Keeps the process's pages in memory while at least one holder does, each page from when it is
/// first touched. Says what it got: "memory locked", or "memory not locked (...)".
std::string lock_memory(bool& locked);
void unlock_memory();

/// Touches the stack that a tick may use, so that its pages are there.
void touch_stack();

}  // namespace viscera
