#include "engine/features/touching/touching.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "engine/features/contact/contact.h"
#include "engine/features/contact/make_contact.h"
#include "engine/features/parting/parting_keys.h"
#include "engine/features/touching/cut_bodies.h"
#include "engine/features/touching/edge_samples.h"
#include "engine/features/touching/folds.h"
#include "engine/features/touching/islands.h"
#include "engine/features/touching/resting.h"
#include "engine/features/touching/touching_flags.h"
#include "kernels/base/finite.h"

namespace viscera {
namespace {

/// Bounds of the distance of patches [m].
constexpr double kFinestPitch = 0.5e-3, kFinestEdgePitch = 1e-3, kCoarsestPitch = 10e-3;
/// Organs that lie farther apart than this at rest are no pair [m]. Chosen: what a retractor lifts.
constexpr double kFarthest = 30e-3;
/// No deeper than this may one that nothing holds begin inside another, and one that is held [m].
/// The latter is chosen: two voxels of an image of 1.5 mm, by which segmented organs overlap.
constexpr double kMostInside = 0.5e-3, kMostInsideHeld = 3e-3;

void reach(const SceneDescription& scene, const OrganDescription& organ,
           const std::vector<InstrumentBody>&, Reach& reach) {
  const TouchingDescription& touching = touching_of(scene);
  if ((touching.organs || touching.folds) && organ.deformable) reach.anywhere = true;
}

bool presses_back(const SceneModel& model, Entity organ) {
  const auto contact = make_contact(model, organ);
  return contact && contact->abilities().springs;
}

/// An organ has so many patches at least: a block's six faces have some six by six then. A soft
/// ball with 200, 140 and 100 of them rolls .53, .51 and .40 of a rigid one's way down a slope; of
/// 100 random organs that fall lay 1.1 mm in others. A heap of 64 balls takes 223, 148 and 86 ms a
/// frame, and with 140 it didn't come to rest in 10 s.
constexpr double kFewestPatches = 200.0;

/// Distance of patches of a surface of this area at most [m].
double coarsest_pitch(double area) {
  return std::min(kCoarsestPitch, std::sqrt(area / kFewestPatches));
}

/// Distance of an organ's patches at a place [m]; `area` of its surface [m2].
double pitch_at(const OrganModel& model, const Vec3& place, double share, double area) {
  const double coarsest = coarsest_pitch(area);
  if (model.touchable.spacings.empty()) return coarsest;  // a local organ has no nodes
  return std::min(std::max(share * spacing_at(model.touchable, place), kFinestPitch), coarsest);
}

/// Distance of places on edges that meet this organ, or are its own [m].
double edge_pitch(const OrganModel& model, double share) {
  const double coarsest = coarsest_pitch(area(model.surface));
  if (model.touchable.spacings.empty()) return coarsest;
  return std::min(std::max(share * model.finest_spacing, kFinestEdgePitch), coarsest);
}

std::string begins_inside(const SceneDescription& scene, std::size_t organ, std::size_t other,
                          double depth, double most) {
  return fmt::format(
      "{}: organs/{}/pose: \"{}\"{} begins {:.1f} mm inside \"{}\"; expected at most {:.1f} mm",
      scene.file.string(), organ, scene.organs[organ].name,
      scene.organs[organ].free ? ", which nothing holds," : "", 1e3 * depth,
      scene.organs[other].name, 1e3 * most);
}

/// It may meet itself.
void add_folds(SceneModel& model, Entity organ, const CollisionSurface& finder) {
  Store& constants = model.constants();
  const std::vector<SurfacePatch>& patches = constants.all<OrganPatches>().find(organ)->patches;
  if (touching_of(model.scene()).folds)
    constants.all<FoldSides>().add(organ, fold_sides(patches, finder));
  OrganPair pair;
  pair.organs = {organ, organ};
  pair.overlaps.assign(patches.size(), 0.0f);  // its surface doesn't cross itself
  constants.all<OrganPair>().add(model.add_entity(), std::move(pair));
}

/// What overlaps at rest is kept, but by a free body.
OrganPair pair_of(const std::array<Entity, 2>& organs, std::vector<float> overlaps, bool free) {
  OrganPair pair{organs, std::move(overlaps), 0.0};
  for (const float overlap : pair.overlaps)
    pair.greatest_overlap = std::max(pair.greatest_overlap, static_cast<double>(overlap));
  if (free) std::ranges::fill(pair.overlaps, 0.0f);
  return pair;
}

/// Where the sharp edges of one organ of a pair may meet the other; how deep one begins in it [m].
double add_edges(SceneModel& model, Entity beside, Entity organ, bool free, double pitch,
                 const std::vector<SharpEdge>& sharp, const CollisionSurface& finder) {
  if (sharp.empty()) return 0.0;
  Store& constants = model.constants();
  const auto body = [&](Entity one) -> const OrganModel& {
    return *constants.all<OrganBody>().find(one)->model;
  };
  EdgeSamples edges = edge_samples(body(organ).surface, sharp, pitch);
  edges.beside = beside;
  const std::array<Entity, 2>& both = constants.all<OrganPair>().find(beside)->organs;
  const Entity other = both[organ == both[0] ? 1 : 0];
  const auto pose = [&](Entity one) { return model.scene().organs[one.index].pose_at(0.0); };
  OrganPair pair = pair_of(
      {organ, other},
      overlaps_of(pose(organ), edges.places, body(other), pose(other), finder, false), free);
  const double deepest = pair.greatest_overlap;
  const Entity entity = model.add_entity();
  constants.all<OrganPair>().add(entity, std::move(pair));
  constants.all<EdgeSamples>().add(entity, std::move(edges));
  return deepest;
}

Result<void> prepare(SceneModel& model) {
  const SceneDescription& scene = model.scene();
  const TouchingDescription& touching = touching_of(scene);
  if (!touching.organs && !touching.folds) return {};
  Store& constants = model.constants();
  std::vector<std::unique_ptr<CollisionSurface>> finders;
  std::vector<bool> soft;
  std::vector<std::vector<SharpEdge>> edges;
  for (const Entity organ : model.organs()) {
    const OrganModel& body = *constants.all<OrganBody>().find(organ)->model;
    finders.push_back(std::make_unique<CollisionSurface>(body.surface, body.rest_positions));
    soft.push_back(presses_back(model, organ));
    edges.push_back(touching.organs ? sharp_edges(body.surface) : std::vector<SharpEdge>());
    if (!soft.back()) continue;
    constants.all<OrganPatches>().add(organ, {patches_on(body, *finders.back(), touching)});
    if (touching.folds || cuttable_of(scene.organs[organ.index]))
      add_folds(model, organ, *finders.back());
  }
  const std::vector<Entity>& organs = model.organs();
  for (std::size_t i = 0; touching.organs && i < organs.size(); ++i)
    for (std::size_t j = i + 1; j < organs.size(); ++j) {
      if (!soft[i] && !soft[j]) continue;
      const auto body = [&](std::size_t o) -> const OrganModel& {
        return *constants.all<OrganBody>().find(organs[o])->model;
      };
      const Pose poses[2] = {scene.organs[i].pose_at(0.0), scene.organs[j].pose_at(0.0)};
      const bool free = scene.organs[i].free || scene.organs[j].free;
      const bool falls = free || cuttable_of(scene.organs[i]) || cuttable_of(scene.organs[j]);
      if (!falls &&
          bounds_at_rest(body(i), poses[0]).exteriorDistance(bounds_at_rest(body(j), poses[1])) >
              kFarthest)
        continue;
      // The finer one brings its patches.
      const bool first = soft[i] && (!soft[j] || body(i).finest_spacing <= body(j).finest_spacing);
      const std::size_t one = first ? i : j, other = first ? j : i;
      OrganPair pair = pair_of({organs[one], organs[other]},
                               overlaps_of(poses[first ? 0 : 1],
                                           constants.all<OrganPatches>().find(organs[one])->patches,
                                           body(other), poses[first ? 1 : 0], *finders[other]),
                               free);
      const double most = free ? kMostInside : kMostInsideHeld;
      const auto refused = [&](double depth) {
        return failure(begins_inside(scene, scene.organs[i].free ? i : j,
                                     scene.organs[i].free ? j : i, depth, most));
      };
      if (pair.greatest_overlap > most) return refused(pair.greatest_overlap);
      const Entity faces = model.add_entity();
      constants.all<OrganPair>().add(faces, std::move(pair));
      for (const std::size_t edged : {one, other})
        if (const double depth =
                add_edges(model, faces, organs[edged], free, edge_pitch(body(one), touching.pitch),
                          edges[edged], *finders[edged == one ? other : one]);
            depth > most)
          return refused(depth);
    }
  return {};
}

Result<void> start(World& world) {
  const Pool<OrganPair>& pairs = world.all<OrganPair>();
  if (pairs.size() == 0) return {};
  for (std::size_t p = 0; p < pairs.size(); ++p) {
    world.all<PairState>().add(pairs.owner(p), {});
    world.all<PairJoints>().add(pairs.owner(p), {});
    for (const Entity organ : pairs[p].organs) {
      if (!world.find<InIsland>(organ)) world.all<InIsland>().add(organ, {});
      if (world.find<OrganTouch>(organ) && !world.find<Resting>(organ))
        world.all<Resting>().add(organ, {});
      if (world.find<OrganContact>(organ) || world.find<StillSurface>(organ)) continue;
      const OrganModel& model = *world.find<OrganBody>(organ)->model;
      world.all<StillSurface>().add(
          organ, {std::make_unique<CollisionSurface>(model.surface, model.rest_positions)});
    }
  }
  world.all<TouchingFigures>().add(kWhole, {});
  world.all<IslandWork>().add(kWhole, {});
  world.all<AllAtRest>().add(kWhole, {});
  bind(world, {solve_islands, is_in_island, rests});
  return {};
}

/// Pairs that overlap by more than this as they rest are named in the report [m]: half of what a
/// shipped scene may have.
constexpr double kReportedOverlap = 0.1e-3;

/// A state that another program made may say anything.
bool is_sound(const Meeting& meeting, std::size_t patches, std::size_t triangles) {
  return meeting.patch < patches && meeting.on.point.triangle >= 0 &&
         static_cast<std::size_t>(meeting.on.point.triangle) < triangles && meeting.on.area > 0.0 &&
         !first_stray(meeting);
}

void restored(World& world) {
  const Pool<OrganPair>& pairs = world.all<OrganPair>();
  if (AllAtRest* all = world.one<AllAtRest>()) all->known = false;
  for (std::size_t p = 0; p < pairs.size(); ++p) {
    const std::size_t patches = brought_now(world, pairs.owner(p)).size();
    const std::size_t triangles =
        world.find<OrganBody>(pairs[p].organs[1])->model->surface.triangles.size();
    std::erase_if(world.find<PairState>(pairs.owner(p))->meetings,
                  [&](const Meeting& meeting) { return !is_sound(meeting, patches, triangles); });
  }
}

}  // namespace

std::vector<SurfacePatch> patches_on(const OrganModel& model, const CollisionSurface& finder,
                                     const TouchingDescription& touching) {
  const double whole = area(model.surface);
  return patches_of(model.surface, model.rest_normals, finder, [&](const Vec3& place) {
    return pitch_at(model, place, touching.pitch, whole);
  });
}

std::vector<ReportSection> touching_report(const World& world) {
  if (!world.has<OrganPair>()) return {};
  const TouchingFigures& figures = *world.one<TouchingFigures>();
  double rest = 0.0;
  Json overlaps = Json::array();
  for (const OrganPair& pair : world.all<OrganPair>()) {
    rest = std::max(rest, pair.greatest_overlap);
    if (pair.greatest_overlap > kReportedOverlap)
      overlaps.push_back({{"between",
                           {world.find<OrganBody>(pair.organs[0])->name,
                            world.find<OrganBody>(pair.organs[1])->name}},
                          {"overlap_m", pair.greatest_overlap}});
  }
  return {report_section("contact", {{"pairs", count_pairs(world)},
                                     {"pairs_meeting", figures.most_pairs},
                                     {"islands", figures.most_islands},
                                     {"organs_at_rest", figures.most_resting},
                                     {"rows", figures.most_rows},
                                     {"greatest_overlap_m", figures.greatest_overlap},
                                     {"overlap_at_rest_m", rest},
                                     {"overlaps_at_rest", overlaps},
                                     {"greatest_force_N", figures.greatest_force},
                                     {"residual", figures.residual},
                                     {"without_answer", figures.failed}})};
}

Feature touching_feature() {
  return {
      .name = "touching",
      .keys = touching_keys(),
      .reach = reach,
      .prepare = prepare,
      .start = start,
      .states = {state_type<PairState>({.unchanged = all_at_rest}), state_type<Resting>(),
                 state_type<TouchingFigures>()},
      .stages = {{.name = "meet organs",
                  .reads = {"organ bodies", "contact cells", "organ poses", "parts of free shapes"},
                  .reads_before = {"surfaces"},
                  .writes = {"contact cells"},
                  .changes = {"organs that touch", "resting organs", "touching figures"},
                  .needed = [](const World& world) { return world.has<OrganPair>(); },
                  .run = meet_organs}},
      .flags = {kOrgansOverlap},
      .replaced = meet_as_cut,
      .restored = restored,
      .report = touching_report};
}

}  // namespace viscera
