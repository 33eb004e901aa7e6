#include "tools/bench/bench_advancing_cut.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <vector>

#include "engine/features/contact/contact.h"
#include "engine/features/features.h"
#include "engine/features/parting/parting.h"
#include "engine/io/interrupt.h"
#include "engine/scene/load_scene.h"
#include "engine/scene/tissues.h"
#include "engine/simulation/frame.h"
#include "engine/simulation/prepare.h"
#include "engine/simulator/build.h"
#include "tools/common/bench_figures.h"
#include "tools/common/project_paths.h"

namespace viscera {
namespace {

constexpr double kSpacing = 4e-3, kCoarse = 5e-3;  // about the cut and elsewhere [m]
constexpr double kSpeed = 10e-3;                   // of the blade [m/s]
constexpr double kBetweenWaits = 10e-3;            // [m]
constexpr double kWait = 5.0;                      // [s]
constexpr int kWaits = 3;
constexpr double kInTime = 1e-9;  // [s]

struct BladeTimes {
  double begins = 0.0;          // to go on [s]
  std::vector<double> arrives;  // where it waits [s]
};

/// The graspers stay where they have drawn to; the blade waits on its way.
Result<BladeTimes> make_blade_wait(SceneDescription& scene) {
  BladeTimes times;
  for (InstrumentDescription& tool : scene.instruments) {
    if (tool.name == "scalpel") {
      if (tool.path.size() < 4) return failure("incision: the scalpel has another path");
      tool.path.resize(3);
      InstrumentKey at = tool.path.back();
      times.begins = at.time;
      for (int wait = 0; wait < kWaits; ++wait) {
        at.time += kBetweenWaits / kSpeed;
        at.tip.y() -= kBetweenWaits;
        tool.path.push_back(at);
        times.arrives.push_back(at.time);
        at.time += kWait;
        tool.path.push_back(at);
      }
      scene.duration = at.time;
    } else {
      tool.path.pop_back();
    }
  }
  if (times.arrives.empty()) return failure("incision: there is no scalpel");
  return times;
}

/// From where a blade takes tissue to the body that lacks it [frames].
struct Lateness {
  std::uint64_t greatest = 0;

  /// After each frame.
  void look(const OrganCut& cut, std::uint64_t frame) {
    if (cut.bodies > bodies_) greatest = std::max(greatest, frame - asked_from_);
    if (cut.pending && cut.due != due_) {
      asked_from_ = changed_at_.value_or(frame);
      changed_at_.reset();
    }
    if (cut.changed && !changed_at_) changed_at_ = frame;
    bodies_ = cut.bodies;
    due_ = cut.due;
  }

 private:
  std::uint64_t bodies_ = 0, due_ = 0, asked_from_ = 0;
  std::optional<std::uint64_t> changed_at_;  // the first that isn't asked for yet
};

Result<std::unique_ptr<World>> start(BladeTimes& times) {
  SceneLoadOptions load;
  load.assets = assets_folder();
  load.features = feature_keys();
  auto scene = load_scene(scenes_folder() / "incision.json", load);
  if (!scene) return std::unexpected(scene.error());
  auto tissues = load_tissues(load.assets / "tissues.json");
  if (!tissues) return std::unexpected(tissues.error());
  for (auto& [name, tissue] : *tissues) tissue.prony.clear();
  scene->organs[0].resolution.spacing = kCoarse;
  scene->organs[0].resolution.finest = kSpacing;
  auto waits = make_blade_wait(*scene);
  if (!waits) return std::unexpected(waits.error());
  times = *waits;
  std::vector<std::string> warnings;
  auto model = build_model(*scene, *tissues, {load.assets, false}, until_interrupted(), warnings);
  if (!model) return std::unexpected(model.error());
  return start_world(*std::move(model));
}

}  // namespace

Result<AdvancingCut> advancing_cut() {
  BladeTimes times;
  auto world = start(times);
  if (!world) return std::unexpected(world.error());
  World& w = **world;
  AdvancingCut cut;
  cut.nodes = w.all<OrganBody>()[0].model->cloud.size();
  cut.spacing = kSpacing;
  cut.speed = kSpeed;
  const std::vector<std::string> stages = stage_names();
  Trace trace(stages);
  Lateness lateness;
  std::vector<double> passing, settled;  // force of the first grasper [N]
  std::vector<bool> goes_on;             // of each frame: the blade
  const auto force = [&] {
    return w.find<InstrumentContact>(w.model().instruments()[0])->force.norm();
  };
  double uncut = 0.0;
  while (settled.size() < times.arrives.size()) {
    if (interrupted()) return failure(kCancelled);
    step_frame(w, trace);
    if (w.all<OrganCut>()[0].area == 0.0) uncut = force();
    lateness.look(w.all<OrganCut>()[0], w.frame());
    if (passing.size() == settled.size()) {
      if (w.time() >= times.arrives[passing.size()]) passing.push_back(force());
    } else if (w.time() >= times.arrives[settled.size()] + kWait - kInTime) {
      settled.push_back(force());
    }
    goes_on.push_back(w.time() > times.begins && passing.size() == settled.size());
  }
  const double change = std::abs(uncut - settled.back());
  for (std::size_t i = 0; i < settled.size(); ++i) {
    const double off = std::abs(passing[i] - settled[i]);
    cut.force_error = std::max(cut.force_error, off / settled[i]);
    cut.missing = std::max(cut.missing, off / change);
  }
  cut.frames_late = static_cast<double>(lateness.greatest);
  cut.worker = w.all<OrganLeft>()[0].greatest_seconds;
  const auto deform = static_cast<int>(std::ranges::find(stages, "deform organs") - stages.begin());
  std::vector<double> frames;
  const std::vector<Trace::Sample> samples = trace.samples(deform);
  for (std::size_t i = 0; i < std::min(samples.size(), goes_on.size()); ++i)
    if (goes_on[i]) frames.push_back(samples[i].seconds);
  cut.frame = quantiles(frames).median;
  if (w.all<OrganCut>()[0].refused > 0)
    return failure("incision: a cut body was refused: " + w.all<OrganLeft>()[0].refusal);
  return cut;
}

}  // namespace viscera
