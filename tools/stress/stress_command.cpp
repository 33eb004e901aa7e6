#include "tools/stress/stress_command.h"

#include <limits>

#include "engine/io/interrupt.h"
#include "tools/common/measuring_commands.h"

namespace viscera {

namespace {

/// Whole scenes, where neither a number nor a time is given.
constexpr int kWholeCases = 60;

}  // namespace

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
  const auto whole = command_->add_flag(
      "--whole", whole_,
      "random scenes of everything instead: organs, tools, devices that fail, links, gravity, "
      "burns, smoke, gas; each by one thread, by two and from a snapshot");
  command_
      ->add_flag("--cuts", whole_options_.cuts,
                 "whole scenes in which scalpels and scissors cut an organ")
      ->needs(whole);
  command_->add_option("--minutes", whole_options_.minutes, "whole scenes for so long")
      ->check(CLI::Range(0.01, 100'000.0))
      ->needs(whole);
  command_
      ->add_option("--inject-fault", fault_,
                   "a test of the checks themselves: flip a sign in the compliance (or, with the "
                   "word force, that of a contact force; with --whole, put NaN into a shape); "
                   "cases must fail")
      ->expected(0, 1)
      ->default_str("compliance")
      ->check(CLI::IsMember({"compliance", "force"}));
  command_->add_option("--keep", whole_options_.keep, "leave the last whole scene in this folder")
      ->needs(whole);
  for (const char* other : {"--json", "--threads"}) whole->excludes(command_->get_option(other));
}

Result<bool> StressCommand::run_whole(std::ostream& out) {
  whole_options_.seed = options_.seed;
  whole_options_.quiet = options_.quiet;
  whole_options_.fault = command_->count("--inject-fault") > 0;
  if (only_ >= 0) {
    whole_options_.first = only_;
    whole_options_.cases = 1;
  } else if (command_->count("--cases") > 0 || whole_options_.minutes == 0.0) {
    whole_options_.cases = command_->count("--cases") > 0 ? options_.cases : kWholeCases;
  }
  return run_whole_stress(whole_options_, out);
}

Result<bool> StressCommand::run(std::ostream& out) {
  options_.json = json_;
  if (only_ >= 0) options_.only = only_;
  if (command_->count("--inject-fault") > 0)
    options_.fault = fault_ == "force" ? StressFault::kForce : StressFault::kCompliance;
  install_interrupt_handler();
  if (whole_) return run_whole(out);
  return run_stress(options_, out);
}

}  // namespace viscera
