// Ctrl-C, SIGTERM and the end of the time allowed as a flag that long work asks, so that no file is
// left half-written.
#pragma once

#include "kernels/base/progress.h"

namespace viscera {

/// From here on the first SIGINT, SIGTERM or SIGHUP only raises the flag; a second one ends the
/// process.
void install_interrupt_handler();

/// The flag is raised, too, after so many seconds of the wall clock, as by SIGALRM; needs the
/// handler.
void interrupt_after(double seconds);

bool interrupted();
/// Progress that shows nothing and stops then.
Progress until_interrupted();
/// The signal that raised the flag, or 0: an interrupted program exits with 128 plus this.
int interrupt_signal();
/// Lowers the flag and restores the default behaviour of these signals.
void remove_interrupt_handler();

}  // namespace viscera
