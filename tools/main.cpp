// The `viscera` program: run, check, import, bench, stress, smoke-info.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <csignal>
#include <exception>
#include <filesystem>
#include <iostream>
#include <limits>
#include <new>
#include <string>
#include <vector>

#include "engine/io/interrupt.h"
#include "engine/io/smoke_file.h"
#include "engine/run.h"
#include "engine/scene/load_scene.h"
#include "tools/bench_command.h"
#include "tools/bench_convergence.h"
#include "tools/bench_hemisphere.h"
#include "tools/check_command.h"
#include "tools/import_command.h"
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

int run_command(const SceneArguments& arguments, RunOptions options) {
  auto scene = arguments.load();
  if (!scene) return fail(scene.error());
  for (const double time : options.snapshots)
    if (!(time >= 0.0 && time <= scene->duration))
      return fail(Error(fmt::format("--snapshots: found {:g} s, expected times from 0 to {:g} s",
                                    time, scene->duration)));
  options.assets = assets_folder();
  auto tissues = load_tissues(options.assets / "tissues.json");
  if (!tissues) return fail(tissues.error());
  install_interrupt_handler();
  auto report = run_scene(*scene, *tissues, options);
  if (!report) return fail(report.error());
  for (const std::string& warning : report->warnings) std::cerr << "warning: " << warning << '\n';
  for (const OrganReport& organ : report->organs)
    if (const std::string line = preparation_line(organ); !line.empty()) std::cerr << line << '\n';
  for (const std::string& flag : report->flags) std::cerr << "note: " << flag << '\n';
  std::cerr << fmt::format(
      "{}: {:.1f} s simulated, {:.1f} x real time without rendering, {:.1f} s in all; see {}\n",
      scene->name, report->duration_s, report->real_time_factor, report->prepare_s + report->wall_s,
      (options.out / "review.html").string());
  return report->complete ? 0 : 128 + interrupt_signal();
}

int smoke_info_command(const std::string& file) {
  auto info = read_smoke_info(file);
  if (!info) return fail(info.error());
  const Vec3 low = 1e3 * info->active_bounds.min(), high = 1e3 * info->active_bounds.max();
  std::cout << fmt::format(
      "volume {}\ntime {:.3f} s\nmass {:.4g} mg\nactive voxels {} of {:.2f} mm\n"
      "bounds ({:.1f}, {:.1f}, {:.1f}) to ({:.1f}, {:.1f}, {:.1f}) mm\n",
      info->volume, info->time, 1e6 * info->mass, info->active_voxels, 1e3 * info->voxel, low.x(),
      low.y(), low.z(), high.x(), high.y(), high.z());
  return 0;
}

void add_hemisphere_options(CLI::App& command, HemisphereBenchOptions& options, std::string& json,
                            std::string& plots) {
  command.add_flag("--quick", options.quick, "fewer cases; under two minutes");
  command.add_flag("--peers", options.peers,
                   "finite elements (gmsh, CalculiX) and Bullet on the same hemisphere");
  command.add_option("--json", json, "write the figures to this file");
  command.add_option("--plot", plots, "draw the figures into this folder");
  const auto list = [&](const char* name, auto& values, const char* what) {
    command.add_option(name, values, what)->delimiter(',')->allow_extra_args(false);
  };
  list("--formulation", options.formulations, "these alone, e.g. galerkin,gfdm");
  list("--nodes", options.nodes, "at most this many nodes, e.g. 500,1100");
  list("--poisson", options.poisson_ratios, "Poisson's ratios, e.g. 0.3,0.4");
  list("--a", options.radii, "contact radii over R, e.g. 0.15,0.2");
  list("--contact", options.contacts, "stick, frictionless or press");
  command.add_flag("--graded", options.graded, "nodes finer about the pole");
  command
      .add_option("--touchable-zone", options.touchable_zone,
                  "touchable within this distance of the axis, over R; 1: everywhere")
      ->check(CLI::Range(0.4, 1.0));
}

int main_program(int argc, char** argv) {
  CLI::App app{"Viscera: a simulator of laparoscopic scenes"};
  app.set_version_flag("--version", VISCERA_VERSION);
  app.require_subcommand(1);

  SceneArguments run_scene_arguments;
  RunOptions run_options;
  std::string out;
  std::string quality = name_of(run_options.quality);
  bool no_render = false, no_cache = false;
  CLI::App* run = app.add_subcommand("run", "simulate a scene and film it");
  run_scene_arguments.add_to(*run);
  run->add_option("--out", out, "folder for film, frames, volumes, curves and report")->required();
  run->add_option("--threads", run_options.threads, "worker threads; 0: all cores")
      ->check(CLI::Range(0, 1024));
  run->add_flag("--no-render", no_render, "no pictures, no film, no EGL context");
  run->add_flag("--no-cache", no_cache, "prepare organs afresh and store nothing");
  run->add_option("--snapshots", run_options.snapshots,
                  "pictures and smoke volumes at these times alone [s], e.g. 2,5,8; no film")
      ->delimiter(',')
      ->allow_extra_args(false);
  run->add_option("--quality", quality, "of the pictures: draft, review or final")
      ->check(CLI::IsMember({"draft", "review", "final"}))
      ->capture_default_str();
  run->add_flag("--quiet", run_options.quiet, "no progress");

  SceneArguments check_scene_arguments;
  CLI::App* check = app.add_subcommand("check", "validate a scene and say what a run will build");
  check_scene_arguments.add_to(*check);

  ImportOptions import_options;
  double edge_mm = 0.0, voxel_mm = 0.0, close_mm = 0.0;
  CLI::App* import = app.add_subcommand(
      "import", "make organs from a label map (NIfTI, NRRD) or a surface (OBJ, STL, PLY, glTF)");
  import->add_option("file", import_options.file, "what to import")->required();
  import->add_flag("--list", import_options.list, "say what the file holds; write nothing");
  import->add_option("--label", import_options.labels, "a label to import, e.g. 5 or 1,5,6")
      ->delimiter(',')
      ->allow_extra_args(false);
  import->add_option("--name", import_options.names, "its name as an organ, e.g. liver")
      ->delimiter(',')
      ->allow_extra_args(false);
  import->add_flag("--all", import_options.all, "every label");
  import->add_option("--out", import_options.out, "folder for the organs");
  import->add_option("--unit", import_options.unit, "length unit of the file: mm, cm or m");
  import->add_option("--tissue", import_options.tissue, "tissue of the entries");
  import->add_option("--edge-mm", edge_mm, "wanted edge of the triangles")
      ->check(CLI::Range(0.05, 100.0));
  import->add_option("--voxel-mm", voxel_mm, "grid on which a surface is wrapped")
      ->check(CLI::Range(0.05, 50.0));
  import->add_option("--close-mm", close_mm, "gaps of a surface up to this width are closed")
      ->check(CLI::Range(0.0, 200.0));

  std::string volume;
  CLI::App* smoke_info = app.add_subcommand("smoke-info", "say what a written smoke volume holds");
  smoke_info->add_option("file", volume, "a .vdb file of a run")->required();

  SceneArguments bench_scene_arguments;
  BenchOptions bench_options;
  std::string bench_json;
  CLI::App* bench = app.add_subcommand("bench", "measure, with the error beside every speed");
  bench->require_subcommand(1);
  CLI::App* bench_main = bench->add_subcommand("scene", "what running a scene costs");
  bench_scene_arguments.add_to(*bench_main);
  bench_main->add_option("--json", bench_json, "write the figures to this file");
  bench_main->add_flag("--quick", bench_options.quick, "three simulated seconds");

  HemisphereBenchOptions hemisphere_options;
  std::string hemisphere_json, hemisphere_plots;
  CLI::App* bench_ball = bench->add_subcommand(
      "hemisphere", "time against error on a pressed hemisphere, for every formulation");
  add_hemisphere_options(*bench_ball, hemisphere_options, hemisphere_json, hemisphere_plots);
  ConvergenceBenchOptions convergence_options;
  std::string convergence_json, convergence_plots;
  CLI::App* bench_cube =
      bench->add_subcommand("convergence", "error and order on a smooth solution on a cube");
  bench_cube->add_flag("--quick", convergence_options.quick, "without the finest clouds");
  bench_cube->add_option("--json", convergence_json, "write the figures to this file");
  bench_cube->add_option("--plot", convergence_plots, "draw the figures into this folder");
  bench_cube->add_option("--formulation", convergence_options.formulations, "these alone")
      ->delimiter(',')
      ->allow_extra_args(false);
  StressCommand stress(app);

  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    if (app.get_subcommands().empty() && argc > 1 && argv[1][0] != '-')
      return fail(Error(fmt::format(
          "found the command \"{}\", expected run, check, import, bench, stress or smoke-info",
          argv[1])));
    return app.exit(error) == 0 ? 0 : kBadInput;
  }

  if (run->parsed()) {
    run_options.out = out;
    run_options.render = !no_render;
    run_options.use_cache = !no_cache;
    run_options.quality = *quality_of(quality);
    const std::vector<std::string> words(argv, argv + argc);
    run_options.command = shell_command(words);
    return run_command(run_scene_arguments, run_options);
  }
  if (check->parsed()) {
    auto scene = check_scene_arguments.load();
    if (!scene) return fail(scene.error());
    auto tissues = load_tissues(assets_folder() / "tissues.json");
    if (!tissues) return fail(tissues.error());
    auto checked = check_scene(*scene, *tissues, std::cout);
    return checked ? 0 : fail(checked.error());
  }
  if (import->parsed()) {
    auto tissues = load_tissues(assets_folder() / "tissues.json");
    if (!tissues) return fail(tissues.error());
    import_options.edge = 1e-3 * edge_mm;
    import_options.voxel = 1e-3 * voxel_mm;
    import_options.close = 1e-3 * close_mm;
    auto imported = import_file(import_options, *tissues, std::cout);
    return imported ? 0 : fail(imported.error());
  }
  if (bench_main->parsed()) {
    auto scene = bench_scene_arguments.load();
    if (!scene) return fail(scene.error());
    auto tissues = load_tissues(assets_folder() / "tissues.json");
    if (!tissues) return fail(tissues.error());
    install_interrupt_handler();
    bench_options.json = bench_json;
    bench_options.scene_arguments = bench_scene_arguments.words();
    auto measured = bench_scene(*scene, *tissues, bench_options, std::cout);
    return measured ? 0 : fail(measured.error());
  }
  if (bench_ball->parsed()) {
    install_interrupt_handler();
    hemisphere_options.json = hemisphere_json;
    hemisphere_options.plots = hemisphere_plots;
    auto measured = bench_hemisphere(hemisphere_options, std::cout);
    return measured ? 0 : fail(measured.error());
  }
  if (bench_cube->parsed()) {
    install_interrupt_handler();
    convergence_options.json = convergence_json;
    convergence_options.plots = convergence_plots;
    auto measured = bench_convergence(convergence_options, std::cout);
    return measured ? 0 : fail(measured.error());
  }
  if (stress.parsed()) {
    const Result<bool> sound = stress.run(std::cout);
    if (!sound) return fail(sound.error());
    return *sound ? 0 : 1;
  }
  return smoke_info_command(volume);
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
