#include "engine/simulation/prepare.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <set>

#include "engine/io/cache_quota.h"
#include "engine/io/response_cache.h"
#include "engine/organ/organ_cache.h"
#include "engine/organ/organ_plan.h"
#include "engine/simulation/feature.h"
#include "engine/simulation/instruments.h"
#include "engine/simulation/tool_shape.h"

namespace viscera {
namespace {

/// Tissue this far from a tip's path may be touched: the width of a contact and of its spreading.
constexpr double kReachMargin = 8e-3;
/// Of a jaw's travel while closed, the share that tissue elsewhere on the organs may follow, and
/// the most that is allowed for.
constexpr double kCarriedShare = 0.5;
constexpr double kCarriedMost = 12e-3;
/// How far beyond what a closing jaw holds the surface at rest may lie: breathing and other tools
/// may have moved it. Chosen.
constexpr double kClosingMargin = 4e-3;
/// Paths are sampled at the frame rate and thinned to this distance [m].
constexpr double kPathPitch = 1e-3;
constexpr double kSampleStep = 1.0 / 60.0;

}  // namespace

Reach reach_of(const std::vector<InstrumentBody>& instruments, const SceneDescription& scene,
               const OrganDescription& organ, const std::vector<Feature>& features) {
  Reach reach;
  // What hives alone answer for has nothing to prepare.
  if (organ.response == Response::kLocal) return reach;
  double size = 0.0, carried = 0.0;
  for (const InstrumentBody& body : instruments) {
    const InstrumentDescription& instrument = body.description;
    size = std::max(size, body.extent);
    if (instrument.kind == InstrumentKind::kGrasper) size = std::max(size, instrument.grip_radius);
    const TipDescription& tip = instrument.tip;
    // A mesh may reach deepest with any of its places.
    const double radius = tip.shape == TipDescription::Shape::kMesh ? body.extent : tip.radius;
    bool closed = false;
    Vec3 closed_at = Vec3::Zero();
    Vec3 last = Vec3::Constant(std::numeric_limits<double>::infinity());
    // The whole path, so that a shorter run takes the same model from the cache.
    const double end = instrument.path.back().time + kSampleStep;
    for (double time = 0.0; time <= end; time += kSampleStep) {
      const Vec3 at = body.tip.at(time);
      // In the organ's frame, which may move under a tip that rests.
      const Vec3 local = organ.pose_at(time).to_local(at);
      // Behind a jaw that has closed the tissue moves along; it is the closing place that counts.
      const bool was_closed = closed;
      closed = instrument.kind == InstrumentKind::kGrasper &&
               jaw_closed(was_closed, body.jaw.at(time).x());
      if (closed && !was_closed) {
        closed_at = at;
        reach.closings.push_back({local, kClosingMargin + instrument.grip_radius});
      }
      if (closed) carried = std::max(carried, (at - closed_at).norm());
      if ((local - last).norm() < kPathPitch) continue;
      reach.tips.push_back({local, radius, closed});
      last = local;
    }
  }
  reach.radius = kReachMargin + size + std::min(kCarriedMost, kCarriedShare * carried);
  for (const Feature& feature : features)
    if (feature.reach) feature.reach(scene, organ, instruments, reach);
  return reach;
}

Tissue tissue_of(const OrganDescription& organ, const std::map<std::string, Tissue>& tissues) {
  Tissue tissue = tissues.at(organ.tissue);
  if (organ.youngs_modulus) tissue.elastic.youngs_modulus = *organ.youngs_modulus;
  if (organ.poisson_ratio) tissue.elastic.poisson_ratio = *organ.poisson_ratio;
  if (organ.material.fibres) tissue.fibres = *organ.material.fibres;
  tissue.model = organ.material.model;
  if (!organ.material.relaxes) tissue.prony = organ.material.prony;
  return tissue;
}

namespace {

/// An organ on its way to a model.
struct OrganInHand {
  OrganDescription organ;  ///< its response isn't auto any more
  Tissue tissue;
  const PreparedShape* shape;
  BodyDemand demand;
  std::string key;
  std::shared_ptr<OrganModel> begun;  ///< of the first with this key, where nothing is in the cache
};

Error with_place(Error error, const SceneDescription& scene, std::size_t organ) {
  if (error.messages.size() == 1 && error.messages[0] == kCancelled) return error;
  for (std::string& message : error.messages)
    if (!message.starts_with(scene.file.string()))
      message = fmt::format("{}: organs/{} (\"{}\"): {}", scene.file.string(), organ,
                            scene.organs[organ].name, message);
  return error;
}

}  // namespace

Result<OrganModels> prepare_organs(const SceneDescription& scene,
                                   const std::vector<InstrumentBody>& instruments,
                                   const std::map<std::string, Tissue>& tissues,
                                   const PrepareOptions& options,
                                   const std::vector<Feature>& features, const Progress& progress,
                                   std::vector<std::string>& warnings) {
  const std::size_t count = scene.organs.size();
  const auto part_of = [&](std::size_t i, double from, double to) {
    return [&, i, from, to](double fraction, std::string_view what) {
      const double done = (static_cast<double>(i) + fraction) / static_cast<double>(count);
      return progress(from + (to - from) * done, fmt::format("{}: {}", scene.organs[i].name, what));
    };
  };
  // All of them are shaped and planned before the first is factored: what can't be, or wouldn't fit
  // together, shows in seconds.
  constexpr double kPlanned = 0.2;
  std::map<std::string, PreparedShape> shapes;  // by key
  std::set<std::string> planned;                // by key
  std::vector<OrganInHand> organs;
  MemoryBudget memory;
  for (std::size_t i = 0; i < count; ++i) {
    OrganDescription organ = scene.organs[i];
    const Tissue tissue = tissue_of(organ, tissues);
    const Reach reach = reach_of(instruments, scene, organ, features);
    const auto failed = [&](const Error& error) {
      return std::unexpected(with_place(error, scene, i));
    };
    if (!part_of(i, 0.0, kPlanned)(0.0, "shaping")) return failure(kCancelled);
    auto name = shape_key(organ.geometry, options.assets);
    if (!name) return failed(name.error());
    auto shape = shapes.find(*name);
    if (shape == shapes.end()) {
      auto made = prepare_shape(organ, options, warnings);
      if (!made) return failed(made.error());
      shape = shapes.emplace(*name, std::move(*made)).first;
    }
    if (auto clear = check_tips(scene, instruments, organ, shape->second.surface); !clear)
      return failed(clear.error());
    auto demand = demand_on(organ, tissue, reach, shape->second.surface);
    if (!demand) return failed(demand.error());
    organ.response = response_of(organ, *demand);
    auto key = organ_key(organ, tissue, shape->second, *demand, options);
    if (!key) return failed(key.error());
    OrganInHand& mine =
        organs.emplace_back(organ, tissue, &shape->second, *std::move(demand), *key, nullptr);
    if (!planned.insert(*key).second) continue;
    const std::uint64_t cached = options.use_cache ? cached_bytes(mine.demand, *key) : 0;
    if (cached > 0) {
      memory.keep(cached);
      continue;
    }
    auto plan = plan_surface(shape->second.surface,
                             {organ, tissue.elastic, mine.demand, options.column_budget});
    if (!plan) return failed(plan.error());
    if (auto fits = set_aside(*plan, memory); !fits) return failed(fits.error());
    if (mine.demand.elastic()) mine.begun = std::move(plan->begun);
  }

  PrepareOptions within = options;
  within.most_memory = std::min(options.most_memory, memory.left());
  OrganModels models;
  std::map<std::string, std::shared_ptr<const OrganModel>> shared;  // by key and storage
  for (std::size_t i = 0; i < count; ++i) {
    OrganInHand& mine = organs[i];
    const OrganDescription& organ = mine.organ;
    std::shared_ptr<const OrganModel>& model =
        shared[fmt::format("{} {}", mine.key, static_cast<int>(organ.displacement_storage))];
    if (!model) {
      auto prepared =
          prepare_organ(organ, mine.tissue, *mine.shape, mine.demand, std::move(mine.begun), within,
                        part_of(i, kPlanned, 1.0), warnings);
      if (!prepared) return std::unexpected(with_place(prepared.error(), scene, i));
      model = std::move(*prepared);
    }
    models.push_back(model);
  }
  if (options.use_cache) {
    CacheQuota quota = cache_quota();
    if (!quota.warning.empty()) warnings.push_back(std::move(quota.warning));
    forget_least_used(ResponseCache::default_folder(), quota.bytes);
  }
  for (const Feature& feature : features)
    if (feature.warn_of_models) feature.warn_of_models(scene, models, warnings);
  return models;
}

Result<std::shared_ptr<SceneModel>> make_model(const SceneDescription& scene,
                                               std::vector<InstrumentBody> instruments,
                                               const OrganModels& models,
                                               const std::map<std::string, Tissue>& tissues,
                                               const std::vector<Feature>& features,
                                               const Schedule& schedule) {
  auto model = std::make_shared<SceneModel>(scene, tissues, features, schedule);
  for (std::size_t i = 0; i < scene.organs.size(); ++i)
    model->add_organ({scene.organs[i].name, tissue_of(scene.organs[i], tissues), models[i]});
  for (InstrumentBody& body : instruments) model->add_instrument(std::move(body));
  const std::set<std::shared_ptr<const OrganModel>> distinct(models.begin(), models.end());
  for (const auto& one : distinct) model->memory().keep(one->memory_bytes());
  for (const Feature& feature : features)
    if (feature.prepare)
      if (auto prepared = feature.prepare(*model); !prepared)
        return std::unexpected(prepared.error());
  return model;
}

Result<std::unique_ptr<World>> start_world(std::shared_ptr<const SceneModel> model) {
  auto world = std::make_unique<World>(std::move(model));
  for (const Feature& feature : world->model().features())
    if (feature.start)
      if (auto started = feature.start(*world); !started) return std::unexpected(started.error());
  return world;
}

}  // namespace viscera
