// `viscera bench`, `viscera profile` and `viscera stress`: another program, started in this one's
// place.
#pragma once

#include <string_view>

#include "kernels/base/result.h"

namespace viscera {

bool is_measuring_command(std::string_view word);

/// Becomes viscera_bench, from the folder in which this program stands itself: it keeps the
/// arguments (the program's name too, for its messages), the environment and the process, and its
/// exit code is this one's. Returns only where it can't be started, with what was expected.
Error start_measuring_program(char** argv);

}  // namespace viscera
