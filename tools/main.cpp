// The `viscera` program: run, haptics, check, import, bench, profile, stress, smoke-info.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <csignal>
#include <exception>
#include <filesystem>
#include <iostream>
#include <map>
#include <new>
#include <optional>
#include <string>
#include <vector>

#include "engine/io/interrupt.h"
#include "engine/io/smoke_file.h"
#include "engine/run.h"
#include "engine/scene/load_scene.h"
#include "tools/bench_command.h"
#include "tools/bench_convergence.h"
#include "tools/bench_heat.h"
#include "tools/bench_hemisphere.h"
#include "tools/bench_hive.h"
#include "tools/bench_smoke.h"
#include "tools/bench_zwidth.h"
#include "tools/check_command.h"
#include "tools/haptics_command.h"
#include "tools/import_command.h"
#include "tools/profile_command.h"
#include "tools/project_paths.h"
#include "tools/stress_command.h"

namespace viscera {
namespace {

/// Bad input, a full disk, a missing driver: the person can mend it.
constexpr int kBadInput = 2;
/// A mistake of this program.
constexpr int kInternalError = 1;

int fail(const Error& error) {
  if (error.messages.size() == 1 && error.messages[0] == kCancelled) {
    std::cerr << "stopped; what was written is whole\n";
    return 128 + interrupt_signal();
  }
  std::cerr << error.text() << '\n';
  return kBadInput;
}

struct SceneArguments {
  std::string scene;
  std::vector<std::string> assets, sets;
  std::string seed, duration;

  void add_to(CLI::App& command) {
    command.add_option("scene", scene, "scene file")->required();
    command
        .add_option("--assets", assets, "a further folder in which geometry files are looked for")
        ->allow_extra_args(false);
    command
        .add_option("--set", sets,
                    "KEY=VALUE: overrides a key of the scene, e.g. "
                    "organs/liver/resolution/finest_spacing_mm=2.5")
        ->allow_extra_args(false);
    command.add_option("--seed", seed, "overrides the scene's seed");
    command.add_option("--duration", duration, "overrides the scene's duration [s]");
  }

  /// The same again for another call of this program.
  std::vector<std::string> words() const {
    std::vector<std::string> all{scene};
    for (const std::string& folder : assets) all.insert(all.end(), {"--assets", folder});
    for (const std::string& set : sets) all.insert(all.end(), {"--set", set});
    if (!seed.empty()) all.insert(all.end(), {"--seed", seed});
    return all;
  }

  Result<SceneDescription> load() const {
    SceneLoadOptions options;
    options.assets = assets_folder();
    options.search.assign(assets.begin(), assets.end());
    for (const std::string& folder : assets)
      if (std::error_code error; !std::filesystem::is_directory(folder, error))
        return failure(fmt::format("--assets {}: no such folder", folder));
    for (const std::string& set : sets) {
      const std::size_t equals = set.find('=');
      if (equals == std::string::npos || equals == 0)
        return failure(fmt::format("--set {}: expected KEY=VALUE", set));
      options.overrides.emplace_back(set.substr(0, equals), set.substr(equals + 1));
    }
    if (!seed.empty()) options.overrides.emplace_back("seed", seed);
    if (!duration.empty()) options.overrides.emplace_back("duration_s", duration);
    return load_scene(scene, options);
  }
};

Result<std::map<std::string, Tissue>> tissues() {
  return load_tissues(assets_folder() / "tissues.json");
}

int code_of(const Result<void>& done) {
  return done ? 0 : fail(done.error());
}

/// Loads what the arguments name and gives it to `use`; its exit code, or that of mistakes.
template <class Use>
int with_scene(const SceneArguments& arguments, const Use& use) {
  auto scene = arguments.load();
  if (!scene) return fail(scene.error());
  auto known = tissues();
  if (!known) return fail(known.error());
  return code_of(use(*scene, *known));
}

CLI::Option* add_list(CLI::App& command, const char* name, auto& values, const char* what) {
  return command.add_option(name, values, what)->delimiter(',')->allow_extra_args(false);
}

// The subcommands. Each stays where it is made, as the parser writes into it.

class RunCommand {
 public:
  explicit RunCommand(CLI::App& program)
      : command_(program.add_subcommand("run", "simulate a scene and film it")) {
    scene_.add_to(*command_);
    command_->add_option("--out", out_, "folder for film, frames, volumes, curves and report")
        ->required();
    command_->add_option("--threads", options_.threads, "worker threads; 0: all cores")
        ->check(CLI::Range(0, 1024));
    command_
        ->add_option("--backend", backend_,
                     "where organs deform and smoke and heat move: cpu, gpu, or auto (the GPU "
                     "where there is one)")
        ->check(CLI::IsMember({"auto", "cpu", "gpu"}))
        ->capture_default_str();
    command_->add_flag("--no-render", no_render_, "no pictures, no film");
    command_->add_flag("--no-cache", no_cache_, "prepare organs afresh and store nothing");
    add_list(*command_, "--snapshots", options_.snapshots,
             "pictures, smoke volumes and surfaces at these times alone [s], e.g. 2,5,8; no film");
    command_->add_option("--quality", quality_, "of the pictures: draft, review or final")
        ->check(CLI::IsMember({"draft", "review", "final"}))
        ->capture_default_str();
    add_list(*command_, "--passes", passes_,
             "ground truth of every picture as passes/NNNN.exr: beauty, clean, scattered, "
             "transmittance, light_transmittance, depth, labels, temperature");
    command_->add_flag("--vtk", options_.vtk,
                       "vtk/organs.pvd for ParaView: deformed organs and forces, at every picture");
    command_->add_flag("--quiet", options_.quiet, "no progress");
  }
  RunCommand(const RunCommand&) = delete;
  RunCommand& operator=(const RunCommand&) = delete;

  bool parsed() const { return command_->parsed(); }

  /// `words`: the command line, for the report.
  int run(const std::vector<std::string>& words) {
    auto scene = scene_.load();
    if (!scene) return fail(scene.error());
    for (const double time : options_.snapshots)
      if (!(time >= 0.0 && time <= scene->duration))
        return fail(Error(fmt::format("--snapshots: found {:g} s, expected times from 0 to {:g} s",
                                      time, scene->duration)));
    auto passes = passes_of(passes_);
    if (!passes) return fail(passes.error());
    options_.passes = std::move(*passes);
    auto known = tissues();
    if (!known) return fail(known.error());
    options_.out = out_;
    options_.assets = assets_folder();
    options_.render = !no_render_;
    options_.quality = *quality_of(quality_);
    options_.backend = *backend_of(backend_);
    options_.use_cache = !no_cache_;
    options_.command = shell_command(words);
    install_interrupt_handler();
    auto report = run_scene(*scene, *known, options_);
    if (!report) return fail(report.error());
    tell(*scene, *report);
    return report->complete ? 0 : 128 + interrupt_signal();
  }

 private:
  void tell(const SceneDescription& scene, const RunReport& report) const {
    for (const std::string& warning : report.warnings) std::cerr << "warning: " << warning << '\n';
    for (const OrganReport& organ : report.organs)
      if (const std::string line = preparation_line(organ); !line.empty())
        std::cerr << line << '\n';
    for (const std::string& flag : report.flags) std::cerr << "note: " << flag << '\n';
    std::cerr << fmt::format(
        "{}: {:.1f} s simulated, {:.1f} x real time without rendering, {:.1f} s in all; see {}\n",
        scene.name, report.duration_s, report.real_time_factor, report.prepare_s + report.wall_s,
        (options_.out / "review.html").string());
  }

  CLI::App* command_;
  SceneArguments scene_;
  RunOptions options_;
  std::string out_;
  std::string quality_ = name_of(options_.quality);
  std::string backend_ = name_of(options_.backend);
  std::vector<std::string> passes_;
  bool no_render_ = false, no_cache_ = false;
};

class CheckCommand {
 public:
  explicit CheckCommand(CLI::App& program)
      : command_(
            program.add_subcommand("check", "validate a scene and say what a run will build")) {
    scene_.add_to(*command_);
  }
  CheckCommand(const CheckCommand&) = delete;
  CheckCommand& operator=(const CheckCommand&) = delete;

  bool parsed() const { return command_->parsed(); }

  int run() const {
    return with_scene(scene_, [](const auto& scene, const auto& known) {
      return check_scene(scene, known, std::cout);
    });
  }

 private:
  CLI::App* command_;
  SceneArguments scene_;
};

class ImportCommand {
 public:
  explicit ImportCommand(CLI::App& program)
      : command_(program.add_subcommand("import",
                                        "make organs from a label map (NIfTI, NRRD) or a surface "
                                        "(OBJ, STL, PLY, glTF)")) {
    command_->add_option("file", options_.file, "what to import")->required();
    command_->add_flag("--list", options_.list, "say what the file holds; write nothing");
    add_list(*command_, "--label", options_.labels, "a label to import, e.g. 5 or 1,5,6");
    add_list(*command_, "--name", options_.names, "its name as an organ, e.g. liver");
    command_->add_flag("--all", options_.all, "every label");
    command_->add_option("--out", options_.out, "folder for the organs");
    command_->add_option("--unit", options_.unit, "length unit of the file: mm, cm or m");
    command_->add_option("--tissue", options_.tissue, "tissue of the entries");
    command_->add_option("--edge-mm", edge_mm_, "wanted edge of the triangles")
        ->check(CLI::Range(0.05, 100.0));
    command_->add_option("--voxel-mm", voxel_mm_, "grid on which a surface is wrapped")
        ->check(CLI::Range(0.05, 50.0));
    command_->add_option("--close-mm", close_mm_, "gaps of a surface up to this width are closed")
        ->check(CLI::Range(0.0, 200.0));
  }
  ImportCommand(const ImportCommand&) = delete;
  ImportCommand& operator=(const ImportCommand&) = delete;

  bool parsed() const { return command_->parsed(); }

  int run() {
    auto known = tissues();
    if (!known) return fail(known.error());
    options_.edge = 1e-3 * edge_mm_;
    options_.voxel = 1e-3 * voxel_mm_;
    options_.close = 1e-3 * close_mm_;
    return code_of(import_file(options_, *known, std::cout));
  }

 private:
  CLI::App* command_;
  ImportOptions options_;
  double edge_mm_ = 0.0, voxel_mm_ = 0.0, close_mm_ = 0.0;
};

/// `bench scene`, `bench hemisphere`, `bench convergence`, `bench smoke`, `bench hive`,
/// `bench heat` and `bench zwidth`.
class BenchCommand {
 public:
  explicit BenchCommand(CLI::App& program)
      : command_(program.add_subcommand("bench", "measure, with the error beside every speed")) {
    command_->require_subcommand(1);
    scene_ = command_->add_subcommand("scene", "what running a scene costs");
    arguments_.add_to(*scene_);
    add_outputs(*scene_, scene_options_.json, nullptr);
    scene_->add_flag("--quick", scene_options_.quick, "three simulated seconds");

    hemisphere_ = command_->add_subcommand(
        "hemisphere", "time against error on a pressed hemisphere, for every formulation");
    add_hemisphere_options();

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
  }
  BenchCommand(const BenchCommand&) = delete;
  BenchCommand& operator=(const BenchCommand&) = delete;

  bool parsed() const { return command_->parsed(); }

  int run() {
    install_interrupt_handler();
    if (hemisphere_->parsed()) return code_of(bench_hemisphere(hemisphere_options_, std::cout));
    if (convergence_->parsed()) return code_of(bench_convergence(convergence_options_, std::cout));
    if (hive_->parsed()) return code_of(bench_hive(hive_options_, std::cout));
    if (smoke_->parsed()) {
      smoke_options_.backend = *backend_of(backend_);
      return code_of(bench_smoke(smoke_options_, std::cout));
    }
    if (heat_->parsed()) return code_of(bench_heat(heat_options_, std::cout));
    if (zwidth_->parsed()) return code_of(bench_zwidth(zwidth_options_, std::cout));
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

  void add_hive_options() {
    hive_->add_flag("--quick", hive_options_.quick, "fewer nodes, one radius");
    add_outputs(*hive_, hive_options_.json, &hive_options_.plots);
    add_list(*hive_, "--nodes", hive_options_.nodes, "at most this many nodes, e.g. 28,80");
    add_list(*hive_, "--radius", hive_options_.radii, "hive radii over R, e.g. 0.3,0.4");
    add_list(*hive_, "--poisson", hive_options_.poisson_ratios, "Poisson's ratios, e.g. 0.3,0.45");
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
  CLI::App* convergence_ = nullptr;
  CLI::App* smoke_ = nullptr;
  CLI::App* hive_ = nullptr;
  CLI::App* heat_ = nullptr;
  CLI::App* zwidth_ = nullptr;
  SceneArguments arguments_;
  BenchOptions scene_options_;
  HemisphereBenchOptions hemisphere_options_;
  ConvergenceBenchOptions convergence_options_;
  SmokeBenchOptions smoke_options_;
  HiveBenchOptions hive_options_;
  HeatBenchOptions heat_options_;
  ZWidthBenchOptions zwidth_options_;
  std::string backend_ = name_of(smoke_options_.backend);
};

class ProfileCommand {
 public:
  explicit ProfileCommand(CLI::App& program)
      : command_(program.add_subcommand("profile",
                                        "what a scene's frames cost with more and more organs")) {
    scene_.add_to(*command_);
    add_list(*command_, "--organs", options_.organs,
             "numbers of organs: the scene's, repeated, each for itself")
        ->capture_default_str();
    command_->add_option("--touched", options_.touched, "so many of them meet the instruments")
        ->capture_default_str();
    command_->add_option("--seconds", seconds_,
                         "simulated in each case; without it the scene's duration");
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
      return profile_scene(scene, known, options_, std::cout);
    });
  }

 private:
  CLI::App* command_;
  SceneArguments scene_;
  ProfileOptions options_;
  std::optional<double> seconds_;
};

class HapticsCommand {
 public:
  explicit HapticsCommand(CLI::App& program)
      : command_(program.add_subcommand(
            "haptics", "feel a scene in real time; say how punctual and how fast that was")) {
    scene_.add_to(*command_);
    command_->add_option("--seconds", options_.seconds, "of the wall clock")->capture_default_str();
    command_->add_option("--device", options_.device, "in place of the scene's")
        ->check(CLI::IsMember({"simulated", "recorded", "network"}));
    command_->add_option("--recording", options_.recording, "file that --device recorded replays");
    command_
        ->add_option("--port", options_.port,
                     "TCP port of --device network; further tools: the next")
        ->check(CLI::Range(1, 65535));
    command_->add_flag("--no-render", no_render_, "no pictures beside");
    command_->add_option("--json", options_.json, "file for the figures");
    command_->add_option("--record", options_.record, "file for what devices did: .csv or .h5");
    command_->add_option("--plot", options_.plots, "folder for histograms");
  }
  HapticsCommand(const HapticsCommand&) = delete;
  HapticsCommand& operator=(const HapticsCommand&) = delete;

  bool parsed() const { return command_->parsed(); }

  int run() {
    options_.render = !no_render_;
    install_interrupt_handler();
    return with_scene(scene_, [&](auto& scene, const auto& known) {
      return run_haptics(std::move(scene), known, options_, std::cout);
    });
  }

 private:
  CLI::App* command_;
  SceneArguments scene_;
  HapticsOptions options_;
  bool no_render_ = false;
};

class SmokeInfoCommand {
 public:
  explicit SmokeInfoCommand(CLI::App& program)
      : command_(program.add_subcommand("smoke-info", "say what a written smoke volume holds")) {
    command_
        ->add_option("file", file_,
                     "a .vdb file of a run; refused without the mark that ends a whole one")
        ->required();
  }
  SmokeInfoCommand(const SmokeInfoCommand&) = delete;
  SmokeInfoCommand& operator=(const SmokeInfoCommand&) = delete;

  bool parsed() const { return command_->parsed(); }

  int run() const {
    auto info = read_smoke_info(file_);
    if (!info) return fail(info.error());
    const Vec3 low = 1e3 * info->active_bounds.min(), high = 1e3 * info->active_bounds.max();
    std::cout << fmt::format(
        "volume {}\ntime {:.3f} s\nmass {:.4g} mg\nactive voxels {} of {:.2f} mm\n"
        "bounds ({:.1f}, {:.1f}, {:.1f}) to ({:.1f}, {:.1f}, {:.1f}) mm\n",
        info->volume, info->time, 1e6 * info->mass, info->active_voxels, 1e3 * info->voxel, low.x(),
        low.y(), low.z(), high.x(), high.y(), high.z());
    for (const SmokeFileInfo::Grid& grid : info->grids)
      std::cout << fmt::format("grid {}: {} [{}]\n", grid.name, grid.type, grid.unit);
    return 0;
  }

 private:
  CLI::App* command_;
  std::string file_;
};

int main_program(int argc, char** argv) {
  CLI::App app{"Viscera: a simulator of laparoscopic scenes"};
  app.set_version_flag("--version", VISCERA_VERSION);
  app.require_subcommand(1);
  RunCommand run(app);
  HapticsCommand haptics(app);
  const CheckCommand check(app);
  ImportCommand import(app);
  const SmokeInfoCommand smoke_info(app);
  BenchCommand bench(app);
  ProfileCommand profile(app);
  StressCommand stress(app);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    if (app.get_subcommands().empty() && argc > 1 && argv[1][0] != '-')
      return fail(
          Error(fmt::format("found the command \"{}\", expected run, haptics, check, import, "
                            "bench, profile, stress or "
                            "smoke-info",
                            argv[1])));
    return app.exit(error) == 0 ? 0 : kBadInput;
  }
  if (run.parsed()) return run.run({argv, argv + argc});
  if (haptics.parsed()) return haptics.run();
  if (check.parsed()) return check.run();
  if (import.parsed()) return import.run();
  if (bench.parsed()) return bench.run();
  if (profile.parsed()) return profile.run();
  if (smoke_info.parsed()) return smoke_info.run();
  const Result<bool> sound = stress.run(std::cout);
  if (!sound) return fail(sound.error());
  return *sound ? 0 : 1;
}

}  // namespace
}  // namespace viscera

int main(int argc, char** argv) {
  // A file that passes a limit of its size is then an error of its write, like a full disk.
  std::signal(SIGXFSZ, SIG_IGN);
  try {
    return viscera::main_program(argc, argv);
  } catch (const std::bad_alloc&) {
    std::cerr << "out of memory: coarser spacings, fewer triangles or smaller volumes need less; "
                 "`viscera check` says how much\n";
    return viscera::kBadInput;
  } catch (const std::exception& error) {
    std::cerr << "internal error: " << error.what() << '\n';
    return viscera::kInternalError;
  }
}
