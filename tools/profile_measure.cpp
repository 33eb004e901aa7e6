#include "tools/profile_measure.h"

#include <malloc.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>

#include "engine/frame.h"
#include "engine/io/interrupt.h"
#include "engine/render/renderer.h"
#include "engine/systems/view.h"
#include "kernels/base/stopwatch.h"

namespace viscera {
namespace {

const std::string kWholeStep = "step";
constexpr std::uint64_t kPictures = 8;

std::vector<std::string> stage_names() {
  std::vector<std::string> names(kStageNames.begin(), kStageNames.end());
  names.push_back(kWholeStep);
  return names;
}

bool is_touched(const OrganContact& contact) {
  return !contact.cells.empty() && contact.solution.converged && contact.solution.touching > 0;
}

std::size_t organs_touched(const World& world) {
  return static_cast<std::size_t>(
      std::count_if(world.organ_contacts.begin(), world.organ_contacts.end(), is_touched));
}

Result<std::unique_ptr<World>> place(const ProfileBench& bench, const SceneDescription& scene) {
  auto instruments = make_instruments(scene);
  if (!instruments) return std::unexpected(instruments.error());
  return place_entities(scene, std::move(*instruments),
                        models_of(bench.models, bench.berths, scene.organs.size()), bench.tissues);
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
  const auto placed = place_entities(scene, std::move(instruments), models, tissues);
  if (!placed) return std::unexpected(placed.error());
  World* const world = placed->get();
  SceneItself result;
  result.touches.assign(scene.organs.size(), 0);
  Trace trace(stage_names());
  trace.reserve(frames * kStageNames.size());
  for (std::uint64_t k = 0; k < frames; ++k) {
    if (interrupted()) return failure(kCancelled);
    const Stopwatch watch;
    step_frame(*world, trace);
    result.wall_s += watch.seconds();
    for (std::size_t o = 0; o < world->organ_bodies.size(); ++o) {
      const OrganContact* contact = world->organ_contacts.find(world->organ_bodies.owner(o));
      if (contact && is_touched(*contact)) ++result.touches[o];
    }
  }
  return result;
}

Result<void> step_case(const ProfileBench& bench, ProfileCase& one, std::unique_ptr<Trace>* kept) {
  auto world = place(bench, fill_berths(bench.scene, bench.berths, one.occupancy));
  if (!world) return std::unexpected(world.error());
  auto trace = std::make_unique<Trace>(stage_names());
  trace->reserve(bench.frames * stage_names().size());
  const int whole = static_cast<int>(kStageNames.size());
  const bool first = one.best_step.empty();
  for (std::uint64_t k = 0; k < bench.frames; ++k) {
    if (interrupted()) return failure(kCancelled);
    const auto start = Trace::Clock::now();
    step_frame(**world, *trace);
    const auto end = Trace::Clock::now();
    trace->add(whole, (*world)->frame, start, end);
    const double seconds = std::chrono::duration<double>(end - start).count();
    if (first) {
      one.best_step.push_back(seconds);
      one.organs_touched.push_back(organs_touched(**world));
    } else {
      one.best_step[k] = std::min(one.best_step[k], seconds);
    }
  }
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
  auto world = place(bench, scene);
  if (!world) return std::unexpected(world.error());
  auto renderer = Renderer::create({});
  if (!renderer) return std::unexpected(renderer.error());
  scene.camera = camera_on_all(scene, **world);
  const Endoscope endoscope(*scene.camera);
  Picture picture;
  const auto draw = [&](std::uint64_t number) {
    return (*renderer)->draw(make_view(**world, scene, endoscope, number), picture);
  };
  // The first picture uploads what rests and compiles what is seen.
  if (auto drawn = draw(0); !drawn) return std::unexpected(drawn.error());
  Trace unseen(stage_names());
  const std::uint64_t step = std::max<std::uint64_t>(1, bench.frames / kPictures);
  for (std::uint64_t k = 1; k <= bench.frames; ++k) {
    if (interrupted()) return failure(kCancelled);
    step_frame(**world, unseen);
    if (k % step != 0) continue;
    splat_smoke(**world);
    const Stopwatch watch;
    if (auto drawn = draw(k / step); !drawn) return std::unexpected(drawn.error());
    values_of(one, "draw").push_back(watch.seconds());
    for (const PassTime& pass : (*renderer)->pass_times())
      values_of(one, "draw: " + pass.name).push_back(pass.seconds);
  }
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
  auto world = place(bench, fill_berths(bench.scene, bench.berths, occupancy));
  if (!world) return std::unexpected(world.error());
  {
    Trace trace(stage_names());
    for (std::uint64_t k = 0; k < bench.frames; ++k) {
      if (interrupted()) return failure(kCancelled);
      step_frame(**world, trace);
      if (organs_touched(**world) >= occupancy.touched) break;
    }
  }
  const std::uint64_t now = resident_bytes();
  return now > before ? now - before : 0;
}

}  // namespace viscera
