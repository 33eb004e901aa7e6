// The `viscera_bench` program: bench, profile and stress. `viscera` starts it for these commands.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <filesystem>
#include <iostream>
#include <optional>
#include <string>
#include <vector>

#include "engine/io/interrupt.h"
#include "engine/run/run.h"
#include "tools/bench/bench_bodies.h"
#include "tools/bench/bench_command.h"
#include "tools/bench/bench_contact.h"
#include "tools/bench/bench_convergence.h"
#include "tools/bench/bench_cut.h"
#include "tools/bench/bench_heat.h"
#include "tools/bench/bench_hemisphere.h"
#include "tools/bench/bench_hive.h"
#include "tools/bench/bench_lift.h"
#include "tools/bench/bench_smoke.h"
#include "tools/bench/bench_steps.h"
#include "tools/bench/bench_zwidth.h"
#include "tools/common/command_line.h"
#include "tools/common/measuring_commands.h"
#include "tools/profile/different_organs.h"
#include "tools/profile/profile_command.h"
#include "tools/stress/stress_command.h"

namespace viscera {
namespace {

/// `bench scene`, `bench hemisphere`, `bench bodies`, `bench convergence`, `bench smoke`,
/// `bench hive`, `bench lift`, `bench contact`, `bench cut`, `bench heat`, `bench zwidth` and
/// `bench steps`.
class BenchCommand {
 public:
  explicit BenchCommand(CLI::App& program)
      : command_(program.add_subcommand(kBenchCommand.name, kBenchCommand.help)) {
    command_->require_subcommand(1);
    scene_ = command_->add_subcommand("scene", "what running a scene costs");
    arguments_.add_to(*scene_);
    add_outputs(*scene_, scene_options_.json, nullptr);
    scene_->add_flag("--quick", scene_options_.quick, "three simulated seconds");

    hemisphere_ = command_->add_subcommand(
        "hemisphere", "time against error on a pressed hemisphere, for every formulation");
    add_hemisphere_options();

    bodies_ = command_->add_subcommand(
        "bodies",
        "time against error where the body decides: slabs, edges, a ball, a bar, spheres");
    add_bodies_options();

    convergence_ =
        command_->add_subcommand("convergence", "error and order on a smooth solution on a cube");
    convergence_->add_flag("--quick", convergence_options_.quick, "without the finest clouds");
    add_outputs(*convergence_, convergence_options_.json, &convergence_options_.plots);
    add_list(*convergence_, "--formulation", convergence_options_.formulations, "these alone");

    smoke_ = command_->add_subcommand(
        "smoke", "time of the passes of smoke, with the error of a shear wave's decay");
    add_smoke_options();

    hive_ = command_->add_subcommand(
        "hive", "time and error of local hives, which answer a hand, on a pressed hemisphere");
    add_hive_options();
    lift_ = command_->add_subcommand(
        "lift", "time a frame against error of organs at finite strain, lifted and bent");
    add_lift_options();
    contact_ =
        command_->add_subcommand("contact", "bodies that touch each other, time against error");
    add_outputs(*contact_, contact_options_.json, &contact_options_.plots);
    cut_ = command_->add_subcommand("cut", "bodies that are cut, time against error");
    cut_->add_flag("--quick", cut_options_.quick, "fewer cases; some seconds");
    add_outputs(*cut_, cut_options_.json, &cut_options_.plots);
    heat_ = command_->add_subcommand(
        "heat", "time of a step of heat, with its error and the standard burn's lesion");
    heat_->add_flag("--quick", heat_options_.quick, "fewer cases; some seconds");
    add_outputs(*heat_, heat_options_.json, &heat_options_.plots);
    zwidth_ = command_->add_subcommand(
        "zwidth", "the stiffest wall that a simulated device shows without rattling");
    zwidth_->add_flag("--quick", zwidth_options_.quick, "three grips and three dampings");
    add_outputs(*zwidth_, zwidth_options_.json, &zwidth_options_.plots);
    add_list(*zwidth_, "--grip", zwidth_options_.grips, "these alone, 0 (loose) to 1 (firm)");
    add_list(*zwidth_, "--damping", zwidth_options_.dampings,
             "these alone, of the coupling [N s/m]");
    steps_ = command_->add_subcommand("steps",
                                      "time of a scene against its error, by the length of a step");
    steps_arguments_.add_to(*steps_);
    add_outputs(*steps_, steps_options_.json, &steps_options_.plots);
  }
  BenchCommand(const BenchCommand&) = delete;
  BenchCommand& operator=(const BenchCommand&) = delete;

  bool parsed() const { return command_->parsed(); }

  int run() {
    install_interrupt_handler();
    if (hemisphere_->parsed()) return code_of(bench_hemisphere(hemisphere_options_, std::cout));
    if (bodies_->parsed()) return code_of(bench_bodies(bodies_options_, std::cout));
    if (convergence_->parsed()) return code_of(bench_convergence(convergence_options_, std::cout));
    if (hive_->parsed()) return code_of(bench_hive(hive_options_, std::cout));
    if (lift_->parsed()) return code_of(bench_lift(lift_options_, std::cout));
    if (contact_->parsed()) return code_of(bench_contact(contact_options_, std::cout));
    if (cut_->parsed()) return code_of(bench_cut(cut_options_, std::cout));
    if (smoke_->parsed()) {
      smoke_options_.backend = *backend_of(backend_);
      return code_of(bench_smoke(smoke_options_, std::cout));
    }
    if (heat_->parsed()) return code_of(bench_heat(heat_options_, std::cout));
    if (zwidth_->parsed()) return code_of(bench_zwidth(zwidth_options_, std::cout));
    if (steps_->parsed())
      return with_scene(steps_arguments_, [&](const auto& scene, const auto& known) {
        return bench_steps(scene, known, steps_options_, std::cout);
      });
    scene_options_.scene_arguments = arguments_.words();
    return with_scene(arguments_, [&](const auto& scene, const auto& known) {
      return bench_scene(scene, known, scene_options_, std::cout);
    });
  }

 private:
  static void add_outputs(CLI::App& command, std::filesystem::path& json,
                          std::filesystem::path* plots) {
    command.add_option("--json", json, "write the figures to this file");
    if (plots) command.add_option("--plot", *plots, "draw the figures into this folder");
  }

  void add_hemisphere_options() {
    CLI::App& command = *hemisphere_;
    HemisphereBenchOptions& options = hemisphere_options_;
    command.add_flag("--quick", options.quick, "fewer cases; under two minutes");
    command.add_flag("--peers", options.peers,
                     "finite elements (gmsh, CalculiX) and Bullet on the same hemisphere");
    add_outputs(command, options.json, &options.plots);
    add_list(command, "--formulation", options.formulations, "these alone, e.g. galerkin,gfdm");
    add_list(command, "--nodes", options.nodes, "at most this many nodes, e.g. 500,1100");
    add_list(command, "--poisson", options.poisson_ratios, "Poisson's ratios, e.g. 0.3,0.4");
    add_list(command, "--a", options.radii, "contact radii over R, e.g. 0.15,0.2");
    add_list(command, "--contact", options.contacts, "stick, frictionless or press");
    command.add_flag("--graded", options.graded, "nodes finer about the pole");
    command
        .add_option("--touchable-zone", options.touchable_zone,
                    "touchable within this distance of the axis, over R; 1: everywhere")
        ->check(CLI::Range(0.4, 1.0));
  }

  void add_bodies_options() {
    bodies_->add_flag("--quick", bodies_options_.quick, "one number of nodes");
    add_outputs(*bodies_, bodies_options_.json, &bodies_options_.plots);
    add_list(*bodies_, "--body", bodies_options_.bodies, "these alone, e.g. slab_2,edge_1.2");
    add_list(*bodies_, "--formulation", bodies_options_.formulations, "these in place of galerkin");
    add_list(*bodies_, "--nodes", bodies_options_.nodes, "at most this many nodes, e.g. 500,1100");
    add_list(*bodies_, "--poisson", bodies_options_.poisson_ratios, "of .30, .45 and .49");
    bodies_->add_option("--write-references", bodies_options_.references,
                        "solve the references anew by finite elements into this folder; long");
  }

  void add_hive_options() {
    hive_->add_flag("--quick", hive_options_.quick, "fewer nodes, one radius");
    add_outputs(*hive_, hive_options_.json, &hive_options_.plots);
    add_list(*hive_, "--nodes", hive_options_.nodes, "at most this many nodes, e.g. 28,80");
    add_list(*hive_, "--radius", hive_options_.radii, "hive radii over R, e.g. 0.3,0.4");
    add_list(*hive_, "--poisson", hive_options_.poisson_ratios, "Poisson's ratios, e.g. 0.3,0.45");
  }

  void add_lift_options() {
    lift_->add_flag("--quick", lift_options_.quick, "without the largest body");
    lift_->add_flag("--peers", lift_options_.peers, "CalculiX beside, where it is installed");
    add_outputs(*lift_, lift_options_.json, &lift_options_.plots);
    add_list(*lift_, "--case", lift_options_.cases, "these alone, e.g. gallbladder,block");
    add_list(*lift_, "--iterations", lift_options_.iterations, "a frame, e.g. 1,2,4");
  }

  void add_smoke_options() {
    add_outputs(*smoke_, smoke_options_.json, &smoke_options_.plots);
    add_list(*smoke_, "--particles", smoke_options_.particles, "a case each, e.g. 10k,100k,1M");
    smoke_
        ->add_option("--backend", backend_,
                     "where the passes run: cpu, gpu, or auto (the GPU where there is one)")
        ->check(CLI::IsMember({"auto", "cpu", "gpu"}))
        ->capture_default_str();
    smoke_->add_option("--steps", smoke_options_.steps, "timed in each case")
        ->capture_default_str();
    smoke_->add_option("--pictures", smoke_options_.pictures, "drawn in each case; 0: none")
        ->capture_default_str();
  }

  CLI::App* command_;
  CLI::App* scene_ = nullptr;
  CLI::App* hemisphere_ = nullptr;
  CLI::App* bodies_ = nullptr;
  CLI::App* convergence_ = nullptr;
  CLI::App* smoke_ = nullptr;
  CLI::App* hive_ = nullptr;
  CLI::App* lift_ = nullptr;
  CLI::App* contact_ = nullptr;
  CLI::App* cut_ = nullptr;
  CLI::App* heat_ = nullptr;
  CLI::App* zwidth_ = nullptr;
  CLI::App* steps_ = nullptr;
  SceneArguments arguments_, steps_arguments_;
  BenchOptions scene_options_;
  HemisphereBenchOptions hemisphere_options_;
  BodiesBenchOptions bodies_options_;
  ConvergenceBenchOptions convergence_options_;
  SmokeBenchOptions smoke_options_;
  HiveBenchOptions hive_options_;
  LiftBenchOptions lift_options_;
  ContactBenchOptions contact_options_;
  CutBenchOptions cut_options_;
  HeatBenchOptions heat_options_;
  ZWidthBenchOptions zwidth_options_;
  StepsBenchOptions steps_options_;
  std::string backend_ = name_of(smoke_options_.backend);
};

class ProfileCommand {
 public:
  explicit ProfileCommand(CLI::App& program)
      : command_(program.add_subcommand(kProfileCommand.name, kProfileCommand.help)) {
    scene_.add_to(*command_);
    add_list(*command_, "--organs", options_.organs,
             "numbers of organs: the scene's, repeated, each for itself")
        ->capture_default_str();
    command_->add_option("--touched", options_.touched, "so many of them meet the instruments")
        ->capture_default_str();
    command_->add_option("--seconds", seconds_,
                         "simulated in each case; without it the scene's duration");
    add_list(*command_, "--different", different_.organs,
             "in place of the scene's organs so many different ones of the tissue of its first, "
             "which touch each other: 14 32 64 128 256");
    command_
        ->add_option("--most-preparation", different_.most_prepare,
                     "with --different: seconds after which no more organs are prepared")
        ->capture_default_str();
    command_->add_flag("--render", options_.render, "pictures too, each pass timed on its device");
    command_->add_option("--json", options_.json, "write the figures to this file");
    command_->add_option("--plot", options_.plots, "draw the figures into this folder");
    command_->add_option("--trace", options_.trace,
                         "timeline of the case with the most organs, for Perfetto");
  }
  ProfileCommand(const ProfileCommand&) = delete;
  ProfileCommand& operator=(const ProfileCommand&) = delete;

  bool parsed() const { return command_->parsed(); }

  int run() {
    install_interrupt_handler();
    return with_scene(scene_, [&](const auto& scene, const auto& known) {
      options_.seconds = seconds_.value_or(scene.duration);
      if (!different_.organs.empty() && !scene.organs.empty()) {
        different_.seconds = seconds_.value_or(different_.seconds);
        different_.json = options_.json;
        different_.plots = options_.plots;
        return profile_different(scene.organs.front().tissue, known, different_, std::cout);
      }
      return profile_scene(scene, known, options_, std::cout);
    });
  }

 private:
  CLI::App* command_;
  SceneArguments scene_;
  ProfileOptions options_;
  DifferentOrgans different_{.organs = {}, .json = {}, .plots = {}};
  std::optional<double> seconds_;
};

int main_program(int argc, char** argv) {
  CLI::App app{"Viscera: what measures its speed and its errors"};
  app.set_version_flag("--version", VISCERA_VERSION);
  app.require_subcommand(1);
  BenchCommand bench(app);
  ProfileCommand profile(app);
  StressCommand stress(app);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    if (app.get_subcommands().empty() && argc > 1 && argv[1][0] != '-')
      return fail(Error(
          fmt::format("found the command \"{}\", expected bench, profile or stress", argv[1])));
    return app.exit(error) == 0 ? 0 : kBadInput;
  }
  if (bench.parsed()) return bench.run();
  if (profile.parsed()) return profile.run();
  const Result<bool> sound = stress.run(std::cout);
  if (!sound) return fail(sound.error());
  return *sound ? 0 : 1;
}

}  // namespace
}  // namespace viscera

int main(int argc, char** argv) {
  return viscera::run_to_the_end(viscera::main_program, argc, argv);
}
