#include "tools/stress/stress_command.h"

#include <limits>

#include "engine/io/interrupt.h"
#include "tools/common/measuring_commands.h"

namespace viscera {

StressCommand::StressCommand(CLI::App& program)
    : command_(program.add_subcommand(kStressCommand.name, kStressCommand.help)) {
  constexpr int kMost = std::numeric_limits<int>::max() - 1;
  command_->add_option("--seed", options_.seed, "names the cases; the same seed, the same cases")
      ->check(CLI::NonNegativeNumber);
  command_->add_option("--cases", options_.cases, "how many")->check(CLI::Range(1, kMost));
  command_->add_option("--case", only_, "this case alone, with all its figures")
      ->check(CLI::Range(0, kMost));
  command_->add_option("--json", json_, "write the summary to this file");
  command_->add_option("--threads", options_.threads, "worker threads; 0: all cores")
      ->check(CLI::Range(0, 1024));
  command_->add_flag("--quiet", options_.quiet, "no progress");
  command_
      ->add_option("--inject-fault", fault_,
                   "a test of the checks themselves: flip a sign in the compliance (or, with the "
                   "word force, that of a contact force); cases must fail")
      ->expected(0, 1)
      ->default_str("compliance")
      ->check(CLI::IsMember({"compliance", "force"}));
}

Result<bool> StressCommand::run(std::ostream& out) {
  options_.json = json_;
  if (only_ >= 0) options_.only = only_;
  if (command_->count("--inject-fault") > 0)
    options_.fault = fault_ == "force" ? StressFault::kForce : StressFault::kCompliance;
  install_interrupt_handler();
  return run_stress(options_, out);
}

}  // namespace viscera
