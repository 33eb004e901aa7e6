// The `viscera` program: run, haptics, check, import, smoke-info; bench, profile and stress are
// another program, which it starts.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <filesystem>
#include <iostream>
#include <optional>
#include <string>
#include <vector>

#include "engine/io/foreign_files.h"
#include "engine/io/interrupt.h"
#include "engine/io/smoke_file.h"
#include "engine/run/run.h"
#include "kernels/base/printable.h"
#include "tools/common/command_line.h"
#include "tools/common/measuring_commands.h"
#include "tools/common/project_paths.h"
#include "tools/viscera/check_command.h"
#include "tools/viscera/haptics_command.h"
#include "tools/viscera/import_command.h"
#include "tools/viscera/start_measuring.h"

namespace viscera {
namespace {

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
    command_
        ->add_option("--checkpoint", options_.checkpoint_s,
                     "write the run's state at most so many seconds of the wall clock apart")
        ->check(CLI::Range(0.1, 1e6));
    command_->add_flag("--resume", options_.resume,
                       "go on from the checkpoint in --out, with the same options");
    command_->add_option("--record-controls", options_.record_controls,
                         "file for what moved the tools, step by step (CSV)");
    command_->add_option("--replay", options_.replay,
                         "file of --record-controls that moves the tools in place of their paths");
    command_
        ->add_option("--time-limit", time_limit_s_,
                     "end after so many seconds of the wall clock, preparation included, as by "
                     "Ctrl-C: every file whole, exit code 142")
        ->check(CLI::Range(0.1, 1e8));
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
    auto known = load_known_tissues();
    if (!known) return fail(known.error());
    options_.out = out_;
    options_.assets = assets_folder();
    options_.render = !no_render_;
    options_.quality = *quality_of(quality_);
    options_.backend = *backend_of(backend_);
    options_.use_cache = !no_cache_;
    options_.command = shell_command(words);
    install_interrupt_handler();
    if (time_limit_s_) interrupt_after(*time_limit_s_);
    auto report = run_scene(*scene, *known, options_);
    if (!report) return fail(report.error());
    tell(*scene, *report);
    if (!report->failures.empty()) return kFailed;
    return report->complete ? 0 : 128 + interrupt_signal();
  }

 private:
  void tell(const SceneDescription& scene, const RunReport& report) const {
    for (const std::string& warning : report.warnings) std::cerr << "warning: " << warning << '\n';
    for (const OrganReport& organ : report.organs)
      if (const std::string line = preparation_line(organ); !line.empty())
        std::cerr << line << '\n';
    for (const std::string& flag : report.flags) std::cerr << "note: " << flag << '\n';
    for (const FailureReport& failure : report.failures)
      std::cerr << printable(fmt::format("error: {} at {:.2f} s: {}", failure.what, failure.time_s,
                                         failure.why))
                << '\n';
    if (!report.failures.empty())
      std::cerr << fmt::format("stopped at {:.2f} s of {:.2f} s; what was written is whole\n",
                               report.duration_s, scene.duration);
    std::cerr << fmt::format(
        "{}: {:.1f} s simulated, {:.2f} x real time without rendering, {:.1f} s in all; see {}\n",
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
  std::optional<double> time_limit_s_;
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
    auto known = load_known_tissues();
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
    const Vec3 low = 1e3 * info->active_bounds().min(), high = 1e3 * info->active_bounds().max();
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
  if (argc > 1 && is_measuring_command(argv[1])) return fail(start_measuring_program(argv));
  CLI::App app{"Viscera: a simulator of laparoscopic scenes"};
  app.set_version_flag("--version", VISCERA_VERSION);
  app.require_subcommand(1);
  RunCommand run(app);
  HapticsCommand haptics(app);
  const CheckCommand check(app);
  ImportCommand import(app);
  const SmokeInfoCommand smoke_info(app);
  // For the list of --help; started above.
  for (const MeasuringCommand& command : kMeasuringCommands)
    app.add_subcommand(command.name, command.help);
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
  if (smoke_info.parsed()) return smoke_info.run();
  return fail(
      Error(fmt::format("found \"{}\" before the command, expected the command first", argv[1])));
}

}  // namespace
}  // namespace viscera

int main(int argc, char** argv) {
  return viscera::run_to_the_end(viscera::main_program, argc, argv);
}
