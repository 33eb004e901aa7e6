#include "engine/features/touching/cut_bodies.h"

#include <algorithm>

#include "engine/features/contact/contact.h"
#include "engine/features/parting/parting.h"
#include "engine/features/touching/edge_samples.h"
#include "engine/features/touching/resting.h"
#include "engine/features/touching/touching.h"

namespace viscera {
namespace {

/// One of a kind for an entity: what it had is gone.
template <class Component>
void put(World& world, Entity entity, Component component) {
  if (Component* before = world.find<Component>(entity))
    *before = std::move(component);
  else
    world.all<Component>().add(entity, std::move(component));
}

const CollisionSurface& rest_surface(const World& world, Entity organ) {
  if (const OrganContact* contact = world.find<OrganContact>(organ)) return *contact->rest;
  return *world.find<StillSurface>(organ)->surface;
}

std::vector<float> overlaps_as_cut(const World& world, Entity entity) {
  const OrganPair& pair = *world.find<OrganPair>(entity);
  const std::vector<SurfacePatch>& brought = brought_now(world, entity);
  const auto& organs = world.model().scene().organs;
  const auto is_free = [&](Entity organ) { return organs[organ.index].free; };
  if (pair.folds() || is_free(pair.organs[0]) || is_free(pair.organs[1]))
    return std::vector<float>(brought.size(), 0.0f);
  const auto pose = [&](Entity organ) { return organs[organ.index].pose_at(0.0); };
  return overlaps_of(pose(pair.organs[0]), brought, *world.find<OrganBody>(pair.organs[1])->model,
                     pose(pair.organs[1]), rest_surface(world, pair.organs[1]),
                     !world.find<EdgeSamples>(entity));
}

}  // namespace

const std::vector<SurfacePatch>& patches_now(const World& world, Entity organ) {
  const CutPatches* cut = world.find<CutPatches>(organ);
  return cut ? cut->patches : world.find<OrganPatches>(organ)->patches;
}

const std::vector<SurfacePatch>& brought_now(const World& world, Entity pair) {
  static const std::vector<SurfacePatch> none;
  const Entity organ = world.find<OrganPair>(pair)->organs[0];
  const EdgeSamples* edges = world.find<EdgeSamples>(pair);
  if (!edges) return patches_now(world, organ);
  const CutPatches* patches = world.find<CutPatches>(organ);
  return patches && patches->cut ? none : edges->places;
}

const std::vector<float>& overlaps_now(const World& world, Entity pair) {
  const CutOverlaps* cut = world.find<CutOverlaps>(pair);
  return cut ? cut->overlaps : world.find<OrganPair>(pair)->overlaps;
}

void meet_as_cut(World& world, Entity organ, const Continuation* continuation) {
  if (!world.find<OrganPatches>(organ)) return;
  if (world.find<Resting>(organ) && rests(world, organ)) wake(world, organ);
  const std::shared_ptr<const OrganModel>& body = world.find<OrganBody>(organ)->model;
  const auto& whole = world.model().constants().all<OrganBody>().find(organ)->model;
  put(world, organ,
      CutPatches{patches_on(*body, rest_surface(world, organ), touching_of(world.model().scene())),
                 body != whole});
  const Pool<OrganPair>& pairs = world.all<OrganPair>();
  for (std::size_t p = 0; p < pairs.size(); ++p) {
    if (std::ranges::find(pairs[p].organs, organ) == pairs[p].organs.end()) continue;
    // By what both are now, in whatever order they became that.
    put(world, pairs.owner(p), CutOverlaps{overlaps_as_cut(world, pairs.owner(p))});
    PairState& state = *world.find<PairState>(pairs.owner(p));
    if (continuation) {
      state.meetings.clear();
      state.gaps.clear();
    }
  }
}

const std::vector<int>& pieces_of(const World& world, Entity organ) {
  static const std::vector<int> one;
  const OrganLeft* left = world.find<OrganLeft>(organ);
  return left ? left->pieces : one;
}

std::optional<CollisionSurface::Hit> nearest_piece(const DrawnOrgan& organ,
                                                   const std::vector<int>& pieces,
                                                   const CollisionSurface& finder,
                                                   const SurfacePatch& patch, double farthest) {
  const int own = piece_of(pieces, organ.surface, patch.point.triangle);
  if (own == 0) return std::nullopt;
  return finder.closest(organ.place_in_organ(patch.point), farthest,
                        [&](const CollisionSurface::Hit& found) {
                          return piece_of(pieces, organ.surface, found.point.triangle) < own;
                        });
}

}  // namespace viscera
