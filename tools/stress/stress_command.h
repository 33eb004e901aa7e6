// `viscera stress` on the command line.
#pragma once

#include <CLI/CLI.hpp>
#include <iosfwd>
#include <string>

#include "kernels/base/result.h"
#include "tools/stress/stress_run.h"
#include "tools/stress/whole_run.h"

namespace viscera {

/// The subcommand "stress" with its options; stays where it is made, as the parser writes into it.
class StressCommand {
 public:
  explicit StressCommand(CLI::App& program);
  StressCommand(const StressCommand&) = delete;
  StressCommand& operator=(const StressCommand&) = delete;

  bool parsed() const { return command_->parsed(); }
  /// After parsing. True: every case passed or was refused with a reason. An error: it was stopped,
  /// or its summary can't be written.
  Result<bool> run(std::ostream& out);

 private:
  Result<bool> run_whole(std::ostream& out);

  CLI::App* command_;
  StressOptions options_;
  WholeOptions whole_options_;
  bool whole_ = false;
  int only_ = -1;
  std::string json_, fault_;
};

}  // namespace viscera
