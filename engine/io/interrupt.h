// Ctrl-C and SIGTERM as a flag that long work asks, so that no file is left half-written.
#pragma once

#include "kernels/base/progress.h"

namespace viscera {

/// From here on the first SIGINT, SIGTERM or SIGHUP only raises the flag; a second one ends the
/// process.
void install_interrupt_handler();

bool interrupted();
/// Progress that shows nothing and stops then.
Progress until_interrupted();
/// The signal that raised the flag, or 0: an interrupted program exits with 128 plus this.
int interrupt_signal();
/// Lowers the flag and restores the default behaviour of these signals.
void remove_interrupt_handler();

}  // namespace viscera
