#include "tools/bench/bench_command.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <nlohmann/json.hpp>
#include <ostream>
#include <vector>

#include "engine/features/deformation/deformation_flags.h"
#include "engine/io/atomic_file.h"
#include "engine/io/interrupt.h"
#include "engine/run/run.h"
#include "engine/scene/soft_ball.h"
#include "engine/simulation/frame.h"
#include "engine/simulator/build.h"
#include "engine/simulator/loop.h"
#include "tools/common/bench_figures.h"
#include "tools/common/project_paths.h"

namespace viscera {
namespace fs = std::filesystem;
namespace {

double stage_median_us(const RunReport& report, std::string_view name) {
  for (const StageReport& stage : report.stages)
    if (stage.name == name) return stage.median_us;
  return 0.0;
}

/// A run that neither Ctrl-C nor a full disk cut short.
Result<RunReport> whole_run(const SceneDescription& scene,
                            const std::map<std::string, Tissue>& tissues,
                            const RunOptions& options) {
  auto report = run_scene(scene, tissues, options);
  if (report && !report->failures.empty()) return failure(report->reason);
  if (report && !report->complete) return failure(kCancelled);
  return report;
}

/// Wall time of the user's program, from its start to the end of a run of one frame [s].
Result<double> time_of_second_start(const std::vector<std::string>& scene_arguments,
                                    const fs::path& out) {
  std::vector<std::string> words = {(program_folder() / "viscera").string(), "run"};
  words.insert(words.end(), scene_arguments.begin(), scene_arguments.end());
  words.insert(words.end(),
               {"--out", out.string(), "--no-render", "--quiet", "--duration", "0.017"});
  const CommandResult done = run_program(words);
  if (done.code != 0) return failure("the second start failed: " + shell_command(words));
  return done.wall_s;
}

/// A simulation of a scene whose tools follow their paths.
Result<Simulation> simulation_of(const SceneDescription& scene,
                                 const std::map<std::string, Tissue>& tissues, bool use_cache) {
  std::vector<std::string> warnings;
  auto model =
      build_model(scene, tissues, {assets_folder(), use_cache}, until_interrupted(), warnings);
  if (!model) return std::unexpected(model.error());
  return Simulation::create(Model(*std::move(model)), {.hands = Hands::kNone});
}

Result<void> unless_interrupted() {
  if (interrupted()) return failure(kCancelled);
  return {};
}

/// Mean force on each instrument over the scene's time [N].
Result<std::vector<double>> mean_forces(const SceneDescription& scene,
                                        const std::map<std::string, Tissue>& tissues) {
  auto simulation = simulation_of(scene, tissues, true);
  if (!simulation) return std::unexpected(simulation.error());
  std::vector<double> sums(scene.instruments.size(), 0.0);
  const std::uint64_t frames = scene.steps.steps_covering(scene.duration);
  auto stepped =
      step_through(*simulation, {.until = frames, .look = [&](Simulation& one, const StepReport&) {
                                   for (std::size_t i = 0; i < sums.size(); ++i)
                                     sums[i] += one.force(i).norm();
                                   return unless_interrupted();
                                 }});
  if (!stepped) return std::unexpected(stepped.error());
  for (double& sum : sums) sum /= static_cast<double>(simulation->frame());
  return sums;
}

/// Greatest relative change of an instrument's mean force when every organ's nodes stand 1.5 times
/// as far apart.
Result<double> change_on_coarser_nodes(SceneDescription scene,
                                       const std::map<std::string, Tissue>& tissues) {
  auto fine = mean_forces(scene, tissues);
  if (!fine) return std::unexpected(fine.error());
  for (OrganDescription& organ : scene.organs) {
    organ.resolution.spacing *= 1.5;
    organ.resolution.finest *= 1.5;
  }
  auto coarse = mean_forces(scene, tissues);
  if (!coarse) return std::unexpected(coarse.error());
  double worst = 0.0;
  for (std::size_t i = 0; i < fine->size(); ++i)
    if ((*fine)[i] > 0.0) worst = std::max(worst, std::abs((*coarse)[i] / (*fine)[i] - 1.0));
  return worst;
}

/// The soft ball under a ball tip that presses it by `depth` [m].
SceneDescription pressed_ball(double finest, double tip_radius, double depth) {
  SceneDescription scene = soft_ball_scene(2.0 * finest, finest);
  scene.duration = 0.5;
  InstrumentDescription probe;
  probe.name = "probe";
  probe.tip.radius = tip_radius;
  probe.trocar = Vec3(0.0, 0.0, 0.2);
  probe.path = {{0.0, Vec3(0.0, 0.0, 25e-3 + tip_radius + 1e-3), 0.0, 1.0},
                {0.3, Vec3(0.0, 0.0, 25e-3 + tip_radius - depth), 0.0, 1.0}};
  scene.instruments = {probe};
  return scene;
}

Result<double> press_force(double finest, double tip_radius, double depth,
                           const std::map<std::string, Tissue>& tissues) {
  auto simulation = simulation_of(pressed_ball(finest, tip_radius, depth), tissues, false);
  if (!simulation) return std::unexpected(simulation.error());
  if (auto stepped = step_through(*simulation, {.until = StepRate().steps_in(0.5)}); !stepped)
    return std::unexpected(stepped.error());
  return simulation->force(0).norm();
}

/// Median time of a frame in which nothing is touched, with `organs` balls that an instrument could
/// reach but doesn't [us].
Result<double> idle_frame_us(int organs, const std::map<std::string, Tissue>& tissues) {
  SceneDescription scene = pressed_ball(6e-3, 2e-3, -3e-3);
  const OrganDescription ball = scene.organs[0];
  scene.organs.clear();
  for (int i = 0; i < organs; ++i) {
    scene.organs.push_back(ball);
    scene.organs.back().name = fmt::format("ball_{}", i);
  }
  auto simulation = simulation_of(scene, tissues, false);
  if (!simulation) return std::unexpected(simulation.error());
  std::vector<double> times;
  Trace::Clock::time_point start;
  Loop loop{.until = 2000};
  // The tip stays clear of every bounding box.
  loop.controls = [&](const Simulation& one) -> Result<Controls> {
    Controls controls = one.path_controls();
    controls.tools[0].tip = Vec3(0.0, 0.0, 0.1);
    start = Trace::Clock::now();
    return controls;
  };
  loop.look = [&](Simulation&, const StepReport&) -> Result<void> {
    times.push_back(std::chrono::duration<double, std::micro>(Trace::Clock::now() - start).count());
    return {};
  };
  if (auto stepped = step_through(*simulation, loop); !stepped)
    return std::unexpected(stepped.error());
  return quantiles(times).median;
}

}  // namespace

Result<void> bench_scene(const SceneDescription& scene_in,
                         const std::map<std::string, Tissue>& tissues, const BenchOptions& options,
                         std::ostream& out) {
  SceneDescription scene = scene_in;
  if (options.quick) scene.duration = std::min(scene.duration, 3.0);
  auto scratch = ScratchFolder::create();
  if (!scratch) return std::unexpected(scratch.error());
  RunOptions run;
  run.assets = assets_folder();
  run.out = (*scratch)->path() / "run";
  run.quiet = true;
  std::vector<BenchRow> rows;

  if (!options.quick) {
    RunOptions fresh = run;
    fresh.use_cache = false;
    fresh.render = false;
    SceneDescription start = scene;
    start.duration = 1.0 / 60.0;
    auto report = whole_run(start, tissues, fresh);
    if (!report) return std::unexpected(report.error());
    rows.push_back({"preparation without cache", "s", report->prepare_s, 120.0});
  } else {
    out << "left out by --quick: preparation without cache, a ball's force at 1.5 mm spacing\n";
  }
  RunOptions blind = run;
  blind.render = false;
  if (auto filled = whole_run(scene, tissues, blind); !filled)
    return std::unexpected(filled.error());
  auto simulated = whole_run(scene, tissues, blind);
  if (!simulated) return std::unexpected(simulated.error());
  auto second = time_of_second_start(options.scene_arguments, run.out);
  if (!second) return std::unexpected(second.error());
  rows.push_back({"second start: the whole program with one frame", "s", *second, 2.0});
  rows.push_back(
      {"simulation over real time, no pictures", "x", simulated->real_time_factor, 1.0, true});
  for (const std::string& flag : simulated->flags)
    if (flag == kContactNotConverged.text)
      rows.back().dropped = {"a frame's contact found no forces"};
  auto filmed = whole_run(scene, tissues, run);
  if (!filmed) return std::unexpected(filmed.error());
  rows.push_back({"a picture of 1280x720, drawn and encoded, median", "s", std::nullopt, 0.35});
  if (filmed->pictures > 0)
    rows.back().value =
        1e-6 * (stage_median_us(*filmed, "draw") + stage_median_us(*filmed, "encode"));
  else
    rows.back().dropped = {"the run drew none: no camera, or no OpenGL driver"};
  rows.push_back(
      {"peak memory of these runs", "GB", 1e-9 * static_cast<double>(peak_memory_bytes()), 2.0});

  auto one = idle_frame_us(1, tissues);
  if (!one) return std::unexpected(one.error());
  auto many = idle_frame_us(65, tissues);
  if (!many) return std::unexpected(many.error());
  rows.push_back({"an idle organ, a frame", "us", (*many - *one) / 64.0, 0.5});

  // What the speeds are worth.
  auto change = change_on_coarser_nodes(scene, tissues);
  if (!change) return std::unexpected(change.error());
  rows.push_back({"mean tool force, nodes 1.5 times as far apart", "%", 100.0 * *change, 10.0});
  // A 2 mm tip, 2 mm deep, on nodes wider apart than the tip, against the
  // same on half and on a quarter of the spacing.
  std::vector<double> forces;
  for (const double spacing : {6e-3, 3e-3, 1.5e-3}) {
    if (options.quick && spacing < 2e-3) continue;
    auto force = press_force(spacing, 2e-3, 2e-3, tissues);
    if (!force) return std::unexpected(force.error());
    forces.push_back(*force);
  }
  rows.push_back({options.quick ? "a ball's force at 6 mm spacing against 3 mm"
                                : "a ball's force at 6 mm spacing against 1.5 mm",
                  "%", 100.0 * std::abs(forces.front() / forces.back() - 1.0), 10.0});

  print_rows(
      rows,
      fmt::format("{} ({}, {} threads)", scene.name, simulated->machine.cpu, simulated->threads),
      out);
  nlohmann::json json = {{"scene", scene.name},
                         {"machine", simulated->machine.cpu},
                         {"cores", simulated->machine.cores},
                         {"threads", simulated->threads},
                         {"renderer", filmed->renderer},
                         {"rows", to_json(rows)}};
  if (options.json.empty()) return {};
  return write_file(options.json, json.dump(2) + "\n");
}

}  // namespace viscera
