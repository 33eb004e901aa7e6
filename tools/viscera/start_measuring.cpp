#include "tools/viscera/start_measuring.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>

#include "tools/common/measuring_commands.h"
#include "tools/common/project_paths.h"

namespace viscera {

bool is_measuring_command(std::string_view word) {
  return std::any_of(kMeasuringCommands.begin(), kMeasuringCommands.end(),
                     [&](const MeasuringCommand& command) { return word == command.name; });
}

Error start_measuring_program(char** argv) {
  const std::filesystem::path program = program_folder() / kMeasuringProgram;
  execv(program.c_str(), argv);
  const int reason = errno;
  if (reason != ENOENT)
    return Error(fmt::format("{}: can't be started: {}", program.string(), std::strerror(reason)));
  return Error(fmt::format(
      "{}: found no such program, expected it beside viscera, as it holds bench, profile and "
      "stress; tools/setup builds it",
      program.string()));
}

}  // namespace viscera
