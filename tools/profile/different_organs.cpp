#include "tools/profile/different_organs.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>
#include <ostream>

#include "engine/features/breathing/breathing_keys.h"
#include "engine/features/contact/contact.h"
#include "engine/features/touching/touching.h"
#include "engine/io/atomic_file.h"
#include "engine/io/interrupt.h"
#include "engine/io/svg_plot.h"
#include "engine/simulation/frame.h"
#include "engine/simulation/prepare.h"
#include "engine/simulator/build.h"
#include "kernels/base/random.h"
#include "kernels/base/stopwatch.h"
#include "tools/common/bench_figures.h"
#include "tools/common/project_paths.h"

namespace viscera {
namespace {

constexpr double kPitch = 24e-3;                   // of the grid [m]
constexpr double kLeast = 10e-3, kMost = 11.5e-3;  // half of an organ's width [m]
/// So many are prepared before the clock is asked.
constexpr int kBatch = 8;

std::size_t organs_awake(const World& world) {
  std::size_t awake = 0;
  for (const Entity organ : world.model().organs()) {
    const OrganTouch* touch = world.find<OrganTouch>(organ);
    if (!touch) continue;
    const OrganContact* contact = world.find<OrganContact>(organ);
    awake += world.find<OrganState>(organ)->deformed || (contact && !contact->cells.empty()) ||
             touch->solver->moving();
  }
  return awake;
}

Result<void> step(const SceneDescription& scene, const OrganModels& models,
                  const std::map<std::string, Tissue>& tissues, double seconds,
                  DifferentCase& one) {
  const Stopwatch placing;
  auto world = place_entities(scene, {}, models, tissues);
  if (!world) return std::unexpected(world.error());
  one.place_s = placing.seconds();
  Trace trace(stage_names());
  while ((*world)->time() < seconds - 1e-9) {
    if (interrupted()) return failure(kCancelled);
    const Stopwatch watch;
    step_frame(**world, trace);
    one.frames.push_back(watch.seconds());
    one.awake = std::max(one.awake, organs_awake(**world));
  }
  if (!(*world)->has<OrganPair>()) return {};
  const TouchingFigures& figures = *(*world)->one<TouchingFigures>();
  one.pairs = count_pairs(**world);
  one.meeting = figures.most_pairs;
  one.islands = figures.most_islands;
  one.rows = figures.most_rows;
  return {};
}

void print(const DifferentCase& one, std::ostream& out) {
  const Quantiles q = quantiles(one.frames);
  out << fmt::format("{:>7}{:>12.1f}{:>9.2f}{:>7}{:>9}{:>9}{:>7}{:>7}{:>12.2f}{:>9.2f}\n",
                     one.organs, one.prepare_s, one.place_s, one.pairs, one.meeting, one.islands,
                     one.rows, one.awake, 1e3 * q.median, 1e3 * q.p99)
      << std::flush;
}

Plot plot_of(const std::vector<DifferentCase>& cases) {
  Plot plot;
  plot.title = "A frame of different organs that touch";
  plot.subtitle = "balls, half balls and blocks; every third breathes into its neighbour";
  plot.x = {"organs", true};
  plot.y = {"time a frame (ms)", true};
  PlotSeries median{"median", {}}, slow{"99 of 100", {}};
  for (const DifferentCase& one : cases) {
    const Quantiles q = quantiles(one.frames);
    median.points.emplace_back(one.organs, 1e3 * q.median);
    slow.points.emplace_back(one.organs, 1e3 * q.p99);
  }
  plot.series = {median, slow};
  return plot;
}

nlohmann::json json_of(const std::vector<DifferentCase>& cases) {
  nlohmann::json all = nlohmann::json::array();
  for (const DifferentCase& one : cases) {
    const Quantiles q = quantiles(one.frames);
    all.push_back({{"organs", one.organs},
                   {"prepare_s", one.prepare_s},
                   {"place_s", one.place_s},
                   {"pairs", one.pairs},
                   {"pairs_meeting", one.meeting},
                   {"islands", one.islands},
                   {"rows", one.rows},
                   {"awake", one.awake},
                   {"median_ms", 1e3 * q.median},
                   {"p99_ms", 1e3 * q.p99}});
  }
  return all;
}

Result<void> check(const DifferentOrgans& options) {
  constexpr int kMostOrgans = 4096;
  for (const int organs : options.organs)
    if (organs < 1 || organs > kMostOrgans)
      return failure(
          fmt::format("--different: found {}, expected from 1 to {}", organs, kMostOrgans));
  if (!(options.most_prepare > 0.0))
    return failure(fmt::format("--most-preparation: found {:g}, expected seconds over 0",
                               options.most_prepare));
  return check_outputs({options.json}, options.plots);
}

}  // namespace

SceneDescription different_organs(int organs, const std::string& tissue) {
  constexpr std::uint64_t kSeed = 1;
  constexpr std::array kRecipes{"sphere", "hemisphere", "block"};
  SceneDescription scene;
  scene.file = scene.name = "different_organs";
  const int across = static_cast<int>(std::ceil(std::sqrt(organs)));
  for (int i = 0; i < organs; ++i) {
    const Random random(kSeed, static_cast<std::uint64_t>(i));
    const double half = kLeast + (kMost - kLeast) * random.uniform(0);
    OrganDescription organ;
    organ.name = fmt::format("organ{}", i);
    organ.tissue = tissue;
    RecipeGeometry geometry;
    geometry.recipe = kRecipes[static_cast<std::size_t>(i) % kRecipes.size()];
    geometry.radius = half;
    const double deep = kLeast + (kMost - kLeast) * random.uniform(1);
    geometry.size = 2.0 * Vec3(half, deep, 0.5 * (half + deep));
    geometry.edge = 3e-3;
    organ.geometry = geometry;
    organ.resolution.spacing = organ.resolution.finest = 6e-3;
    organ.response = Response::kLinear;
    Region below;
    below.a = Vec3(0, 0, geometry.recipe == "hemisphere" ? 1e-3 : -0.6 * half);
    below.b = Vec3::UnitZ();
    organ.fixed = {below};
    organ.pose.position =
        kPitch * Vec3(static_cast<double>(i % across), static_cast<double>(i / across), 0.0);
    if (i % 3 == 0)
      set_motion(organ, {.amplitude = 5e-3,
                         .direction = Vec3::UnitX(),
                         .period = 1.0 + 0.5 * random.uniform(2),
                         .phase = 0.0});
    scene.organs.push_back(std::move(organ));
  }
  scene.extras.set(TouchingDescription{.organs = true});
  return scene;
}

Result<void> profile_different(const std::string& tissue,
                               const std::map<std::string, Tissue>& tissues,
                               const DifferentOrgans& options, std::ostream& out) {
  if (auto sound = check(options); !sound) return sound;
  std::vector<int> counts = options.organs;
  std::ranges::sort(counts);
  out << fmt::format("{:>7}{:>12}{:>9}{:>7}{:>9}{:>9}{:>7}{:>7}{:>12}{:>9}\n", "organs",
                     "prepared s", "placed s", "pairs", "meeting", "islands", "rows", "awake",
                     "median ms", "p99 ms");
  std::vector<DifferentCase> cases;
  OrganModels models;
  double spent = 0.0;
  for (const int count : counts) {
    const SceneDescription scene = different_organs(count, tissue);
    while (models.size() < static_cast<std::size_t>(count) && spent <= options.most_prepare) {
      // Where an organ stands has no part in what is prepared of it.
      SceneDescription batch = scene;
      const auto begin = static_cast<std::ptrdiff_t>(models.size());
      const auto end = std::min<std::ptrdiff_t>(begin + kBatch, count);
      batch.organs.assign(scene.organs.begin() + begin, scene.organs.begin() + end);
      std::vector<std::string> warnings;
      const Stopwatch watch;
      auto more = prepare_organs(batch, {}, tissues, {assets_folder(), true}, until_interrupted(),
                                 warnings);
      if (!more) return std::unexpected(more.error());
      spent += watch.seconds();
      models.insert(models.end(), more->begin(), more->end());
    }
    if (models.size() < static_cast<std::size_t>(count)) {
      out << fmt::format(
          "left out: {} organs: {} were prepared within {:.0f} s, expected at most that long; once "
          "more, those are taken from the cache (--most-preparation allows more)\n",
          count, models.size(), options.most_prepare);
      break;
    }
    DifferentCase one{.organs = count, .prepare_s = spent, .frames = {}};
    if (auto done = step(scene, models, tissues, options.seconds, one); !done) return done;
    print(one, out);
    cases.push_back(std::move(one));
  }
  if (!options.plots.empty())
    if (auto drawn = write_file(options.plots / "different_organs.svg", to_svg(plot_of(cases)));
        !drawn)
      return drawn;
  return write_cases(options.json, json_of(cases), {});
}

}  // namespace viscera
