#include "tools/bench_command.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <ostream>
#include <vector>

#include "engine/frame.h"
#include "engine/io/atomic_file.h"
#include "engine/io/interrupt.h"
#include "engine/run.h"
#include "engine/scene/soft_ball.h"
#include "engine/world.h"
#include "tools/project_paths.h"

namespace viscera {
namespace fs = std::filesystem;
namespace {

/// A folder that goes with the benchmark.
class ScratchFolder {
 public:
  ScratchFolder() {
    std::string name = (fs::temp_directory_path() / "viscera_bench_XXXXXX").string();
    if (mkdtemp(name.data())) path_ = name;
  }
  ~ScratchFolder() {
    std::error_code ignored;
    if (!path_.empty()) fs::remove_all(path_, ignored);
  }
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;
  const fs::path& path() const { return path_; }

 private:
  fs::path path_;
};

/// A figure beside what it is to reach.
struct Row {
  std::string what, unit;
  double value = 0.0, target = 0.0;
  bool at_least = false;   ///< the target is a lower bound
  bool met() const { return at_least ? value >= target : value <= target; }
};

double stage_median_us(const RunReport& report, std::string_view name) {
  for (const StageReport& stage : report.stages)
    if (stage.name == name) return stage.median_us;
  return 0.0;
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

Result<std::unique_ptr<World>> world_of(const SceneDescription& scene,
                                        const std::map<std::string, Tissue>& tissues) {
  WorldOptions options;
  options.prepare = {assets_folder(), false};
  WorldNotes notes;
  return build_world(scene, tissues, options,
                     [](double, std::string_view) { return !interrupted(); }, notes);
}

Result<double> press_force(double finest, double tip_radius, double depth,
                           const std::map<std::string, Tissue>& tissues) {
  auto world = world_of(pressed_ball(finest, tip_radius, depth), tissues);
  if (!world) return std::unexpected(world.error());
  Trace trace({kStageNames.begin(), kStageNames.end()});
  while ((*world)->time() < 0.5) step_frame(**world, trace);
  return (*world)->instrument_contacts[0].force.norm();
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
  auto world = world_of(scene, tissues);
  if (!world) return std::unexpected(world.error());
  // The tip stays clear of every bounding box from here on.
  for (InstrumentBody& body : (*world)->instrument_bodies)
    body.tip = KeyFrames({0.0}, {Vec3(0.0, 0.0, 0.1)});
  std::vector<double> times;
  for (int i = 0; i < 2000; ++i) {
    Trace trace({kStageNames.begin(), kStageNames.end()});
    const auto start = Trace::Clock::now();
    step_frame(**world, trace);
    times.push_back(std::chrono::duration<double, std::micro>(Trace::Clock::now() - start).count());
  }
  return quantiles(times).median;
}

}  // namespace

Result<void> bench_scene(const SceneDescription& scene_in,
                         const std::map<std::string, Tissue>& tissues, const BenchOptions& options,
                         std::ostream& out) {
  SceneDescription scene = scene_in;
  if (options.quick) scene.duration = std::min(scene.duration, 3.0);
  const ScratchFolder scratch;
  RunOptions run;
  run.assets = assets_folder();
  run.out = scratch.path() / "run";
  run.quiet = true;
  std::vector<Row> rows;

  if (!options.quick) {
    RunOptions fresh = run;
    fresh.use_cache = false;
    fresh.render = false;
    SceneDescription start = scene;
    start.duration = 1.0 / 60.0;
    auto report = run_scene(start, tissues, fresh);
    if (!report) return std::unexpected(report.error());
    rows.push_back({"preparation without cache", "s", report->prepare_s, 120.0});
  }
  RunOptions blind = run;
  blind.render = false;
  if (auto filled = run_scene(scene, tissues, blind); !filled)
    return std::unexpected(filled.error());
  auto simulated = run_scene(scene, tissues, blind);
  if (!simulated) return std::unexpected(simulated.error());
  rows.push_back({"second start until the first frame", "s", simulated->prepare_s, 2.0});
  rows.push_back({"simulation over real time, no pictures", "x", simulated->real_time_factor, 1.0,
                  true});
  auto filmed = run_scene(scene, tissues, run);
  if (!filmed) return std::unexpected(filmed.error());
  if (filmed->pictures > 0)
    rows.push_back({"a picture of 1280x720 with smoke, encoded", "s",
                    1e-6 * (stage_median_us(*filmed, "draw") + stage_median_us(*filmed, "encode")),
                    0.35});
  rows.push_back({"peak memory", "GB", 1e-9 * static_cast<double>(peak_memory_bytes()), 2.0});

  auto one = idle_frame_us(1, tissues);
  if (!one) return std::unexpected(one.error());
  auto many = idle_frame_us(65, tissues);
  if (!many) return std::unexpected(many.error());
  rows.push_back({"an idle organ, a frame", "us", (*many - *one) / 64.0, 0.5});

  // What the speeds are worth: a 2 mm tip, 2 mm deep, on nodes wider apart than the tip, against the
  // same on half and on a quarter of the spacing.
  std::vector<double> forces;
  for (const double spacing : {6e-3, 3e-3, 1.5e-3}) {
    if (options.quick && spacing < 2e-3) continue;
    auto force = press_force(spacing, 2e-3, 2e-3, tissues);
    if (!force) return std::unexpected(force.error());
    forces.push_back(*force);
  }
  rows.push_back({"force error at 6 mm spacing against the finest", "%",
                  100.0 * std::abs(forces.front() / forces.back() - 1.0), 10.0});

  out << fmt::format("{:<50}{:>12}{:>12}\n", fmt::format("{} ({}, {} threads)", scene.name,
                                                           simulated->machine.cpu,
                                                           simulated->threads),
                     "measured", "to reach");
  nlohmann::json json = {{"scene", scene.name},
                         {"machine", simulated->machine.cpu},
                         {"cores", simulated->machine.cores},
                         {"threads", simulated->threads},
                         {"renderer", filmed->renderer},
                         {"rows", nlohmann::json::array()}};
  for (const Row& row : rows) {
    out << fmt::format("{:<50}{:>9.3g} {:<3}{:>7} {:<3}{}\n", row.what, row.value, row.unit,
                       fmt::format("{}{:g}", row.at_least ? ">" : "<", row.target), row.unit,
                       row.met() ? "met" : "NOT MET");
    json["rows"].push_back({{"what", row.what},
                            {"unit", row.unit},
                            {"value", row.value},
                            {"target", row.target},
                            {"met", row.met()}});
  }
  if (options.json.empty()) return {};
  return write_file(options.json, json.dump(2) + "\n");
}

}  // namespace viscera
