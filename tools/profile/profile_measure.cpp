#include "tools/profile/profile_measure.h"

#include <malloc.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <functional>

#include "engine/io/interrupt.h"
#include "engine/render/renderer.h"
#include "engine/run/view.h"
#include "engine/simulation/frame.h"
#include "engine/simulator/build.h"
#include "engine/simulator/loop.h"
#include "kernels/base/stopwatch.h"

namespace viscera {
namespace {

const std::string kWholeStep = "step";
constexpr std::uint64_t kPictures = 8;

std::vector<std::string> traced_names() {
  std::vector<std::string> names = stage_names();
  names.push_back(kWholeStep);
  return names;
}

/// By a tool, with more than zero force: links press organs, too.
bool is_touched(const OrganTouch& touch) {
  return std::ranges::any_of(touch.ranges,
                             [](const CellRange& range) { return !range.force.isZero(0.0); });
}

std::size_t organs_touched(const World& world) {
  return static_cast<std::size_t>(
      std::count_if(world.all<OrganTouch>().begin(), world.all<OrganTouch>().end(), is_touched));
}

/// Simulations whose tools follow their paths.
Result<Simulation> placed(const SceneDescription& scene, std::vector<InstrumentBody> instruments,
                          const OrganModels& models, const std::map<std::string, Tissue>& tissues) {
  auto world = place_entities(scene, std::move(instruments), models, tissues);
  if (!world) return std::unexpected(world.error());
  return Simulation(*std::move(world));
}

Result<Simulation> place(const ProfileBench& bench, const SceneDescription& scene) {
  auto instruments = make_instruments(scene);
  if (!instruments) return std::unexpected(instruments.error());
  return placed(scene, std::move(*instruments),
                models_of(bench.models, bench.berths, scene.organs.size()), bench.tissues);
}

/// Steps on, until Ctrl-C.
Result<void> step_on(Simulation& simulation, std::uint64_t frames,
                     std::function<Result<void>(Simulation&, const StepReport&)> look) {
  Loop loop{.until = simulation.frame() + frames};
  loop.look = [&](Simulation& one, const StepReport& report) -> Result<void> {
    if (interrupted()) return failure(kCancelled);
    return look(one, report);
  };
  return step_through(simulation, loop);
}

std::vector<double>& values_of(ProfileCase& one, const std::string& stage) {
  for (auto& [name, values] : one.stages)
    if (name == stage) return values;
  return one.stages.emplace_back(stage, std::vector<double>()).second;
}

}  // namespace

Quantiles ProfileCase::stage(const std::string& name) const {
  for (const auto& [stage, values] : stages)
    if (stage == name) return quantiles(values);
  return {};
}

Result<SceneItself> step_scene_itself(const SceneDescription& scene,
                                      std::vector<InstrumentBody> instruments,
                                      const OrganModels& models,
                                      const std::map<std::string, Tissue>& tissues,
                                      std::uint64_t frames) {
  auto simulation = placed(scene, std::move(instruments), models, tissues);
  if (!simulation) return std::unexpected(simulation.error());
  SceneItself result;
  result.touches.assign(scene.organs.size(), 0);
  Stopwatch watch;
  auto stepped = step_on(*simulation, frames, [&](Simulation& one, const StepReport&) {
    result.wall_s += watch.seconds();
    const World& world = one.world();
    for (std::size_t o = 0; o < world.model().organs().size(); ++o) {
      const OrganTouch* touch = world.find<OrganTouch>(world.model().organs()[o]);
      if (touch && is_touched(*touch)) ++result.touches[o];
    }
    watch = Stopwatch();
    return Result<void>();
  });
  if (!stepped) return std::unexpected(stepped.error());
  return result;
}

Result<void> step_case(const ProfileBench& bench, ProfileCase& one, std::unique_ptr<Trace>* kept) {
  auto simulation = place(bench, fill_berths(bench.scene, bench.berths, one.occupancy));
  if (!simulation) return std::unexpected(simulation.error());
  auto trace = std::make_unique<Trace>(traced_names());
  trace->reserve(bench.frames * traced_names().size());
  simulation->trace(trace.get());
  const int whole = static_cast<int>(traced_names().size()) - 1;
  const bool first = one.best_step.empty();
  auto start = Trace::Clock::now();
  auto stepped = step_on(*simulation, bench.frames, [&](Simulation& stepping, const StepReport&) {
    const auto end = Trace::Clock::now();
    trace->add(whole, stepping.frame(), start, end);
    const double seconds = std::chrono::duration<double>(end - start).count();
    if (first) {
      one.best_step.push_back(seconds);
      one.organs_touched.push_back(organs_touched(stepping.world()));
    } else {
      double& best = one.best_step[stepping.frame() - 1];
      best = std::min(best, seconds);
    }
    start = Trace::Clock::now();
    return Result<void>();
  });
  if (!stepped) return stepped;
  const bool touches = std::any_of(one.organs_touched.begin(), one.organs_touched.end(),
                                   [](std::size_t organs) { return organs > 0; });
  for (int stage = 0; stage <= whole; ++stage) {
    const std::vector<Trace::Sample> samples = trace->samples(stage);
    if (samples.empty()) continue;
    std::vector<double>& values = values_of(one, trace->stages()[static_cast<std::size_t>(stage)]);
    for (const Trace::Sample& sample : samples)
      if (!touches || one.organs_touched[sample.frame - 1] > 0) values.push_back(sample.seconds);
  }
  if (kept) *kept = std::move(trace);
  return {};
}

Result<std::string> draw_case(const ProfileBench& bench, ProfileCase& one) {
  SceneDescription scene = fill_berths(bench.scene, bench.berths, one.occupancy);
  auto simulation = place(bench, scene);
  if (!simulation) return std::unexpected(simulation.error());
  const World& world = simulation->world();
  auto renderer = Renderer::create({});
  if (!renderer) return std::unexpected(renderer.error());
  scene.camera = camera_on_all(scene, world);
  const Endoscope endoscope(*scene.camera);
  Picture picture;
  Shown shown;
  const auto draw = [&](std::uint64_t number) {
    return (*renderer)->draw(make_view(world, shown, scene, endoscope, number), picture);
  };
  // The first picture uploads what rests and compiles what is seen.
  if (auto drawn = draw(0); !drawn) return std::unexpected(drawn.error());
  const std::uint64_t every = std::max<std::uint64_t>(1, bench.frames / kPictures);
  auto stepped = step_on(*simulation, bench.frames,
                         [&](Simulation& stepping, const StepReport&) -> Result<void> {
                           if (stepping.frame() % every != 0) return {};
                           splat_smoke(world, shown.smoke);
                           const Stopwatch watch;
                           if (auto drawn = draw(stepping.frame() / every); !drawn) return drawn;
                           values_of(one, "draw").push_back(watch.seconds());
                           for (const PassTime& pass : (*renderer)->pass_times())
                             values_of(one, "draw: " + pass.name).push_back(pass.seconds);
                           return {};
                         });
  if (!stepped) return std::unexpected(stepped.error());
  return (*renderer)->device();
}

std::uint64_t resident_bytes() {
  malloc_trim(0);
  std::ifstream statm("/proc/self/statm");
  std::uint64_t size = 0, resident = 0;
  statm >> size >> resident;
  return resident * static_cast<std::uint64_t>(sysconf(_SC_PAGESIZE));
}

Result<std::uint64_t> memory_of(const ProfileBench& bench, const Occupancy& occupancy,
                                std::uint64_t before) {
  auto simulation = place(bench, fill_berths(bench.scene, bench.berths, occupancy));
  if (!simulation) return std::unexpected(simulation.error());
  Loop loop{.until = bench.frames};
  loop.pace = [&](Simulation& one) {
    return !interrupted() && (one.frame() == 0 || organs_touched(one.world()) < occupancy.touched);
  };
  if (auto stepped = step_through(*simulation, loop); !stepped)
    return std::unexpected(stepped.error());
  if (interrupted()) return failure(kCancelled);
  const std::uint64_t now = resident_bytes();
  return now > before ? now - before : 0;
}

}  // namespace viscera
