// Runs the built `viscera` program as a person would, with its own cache, and keeps what it said.
#pragma once

#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "tests/support/paths.h"

namespace viscera::test {

struct ProgramCall {
  std::vector<std::string> arguments = {};          ///< after the program's name
  std::filesystem::path cache = {};                 ///< becomes VISCERA_CACHE
  std::optional<std::size_t> greatest_file = {};    ///< bytes; no file may grow beyond: a full disk
  std::optional<std::size_t> greatest_memory = {};  ///< bytes of address space
  /// Asked with what stderr has said so far; once it is true, the program gets a signal.
  std::function<bool(const std::string&)> interrupt_when = {};
  int interrupt_signal = SIGINT;  ///< what it gets in its place
  /// Variables of its environment besides, "NAME=VALUE"; they come before ours.
  std::vector<std::string> variables = {};
  double timeout = 300.0;  ///< [s]; then the program is killed
};

struct ProgramResult {
  int code = -1;   ///< exit code; -1 where a signal ended it
  int signal = 0;  ///< that ended it
  std::string out, err;
  double wall_s = 0.0;
  bool interrupted = false;  ///< the signal was sent

  /// For failed expectations.
  std::string told() const;
};

ProgramResult run_program(const ProgramCall& call);

/// Any program of the PATH; for looking at what viscera wrote.
ProgramResult run_command(const std::vector<std::string>& words);

/// Expects this exit code, one message with all `words`, and none of a crash's traces.
void expect_failed(const ProgramResult& result, int code, const std::vector<std::string>& words);
/// With exit code 2.
void expect_refused(const ProgramResult& result, const std::vector<std::string>& words);

/// Expects that nothing in the folder has a temporary name and that every file in it reads to its
/// end: JSON parses, pictures and pages end, volumes open, tables have whole rows.
void expect_whole_files(const std::filesystem::path& folder);

/// Files below the folder with this extension (".png").
std::vector<std::filesystem::path> files_of(const std::filesystem::path& folder,
                                            const std::string& extension);

/// While it lives, programs find no OpenGL driver.
class WithoutDrivers {
 public:
  WithoutDrivers() { setenv("__EGL_VENDOR_LIBRARY_FILENAMES", "/nowhere/no_driver.json", 1); }
  ~WithoutDrivers() { unsetenv("__EGL_VENDOR_LIBRARY_FILENAMES"); }
};

}  // namespace viscera::test
