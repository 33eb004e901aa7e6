#include "engine/features/touching/resting.h"

#include <algorithm>
#include <utility>

#include "engine/features/coagulation/coagulation.h"
#include "engine/features/gravity/gravity.h"
#include "engine/features/links/links.h"
#include "engine/features/pulsation/pulsation.h"
#include "engine/features/touching/islands.h"
#include "engine/features/touching/touching.h"

namespace viscera {
namespace {

/// Without a change until an island rests. Drawn surfaces are made anew where some place has moved
/// by 5 um since they were last (deform_organs.cpp), so what rests goes slower than 10 um/s. Chosen
/// [s].
constexpr double kTimeToRest = 0.5;

std::int32_t frames_to_rest(const World& world) {
  return static_cast<std::int32_t>(world.model().steps().steps_in(kTimeToRest));
}

Vec3 weight_on(const World& world, Entity organ) {
  const OrganSag* sag = world.find<OrganSag>(organ);
  return sag ? sag->change : Vec3(Vec3::Zero());
}

std::int64_t stiffenings_of(const World& world, Entity organ) {
  const OrganChange* change = world.find<OrganChange>(organ);
  return change ? change->updates : 0;
}

/// Whether a tool or a shaft lies on it: others' cells aren't laid yet.
bool has_tools(const World& world, Entity organ) {
  return !world.find<OrganContact>(organ)->cells.empty();
}

/// By a tool, or by what is its own.
bool is_disturbed(const World& world, Entity organ, const Resting& resting) {
  const FreeShape* shape = world.find<FreeShape>(organ);
  return has_tools(world, organ) || is_link_loaded(world, organ) || (shape && shape->changed) ||
         !yields(world, organ) || weight_on(world, organ) != resting.weight ||
         stiffenings_of(world, organ) != resting.stiffenings;
}

bool may_rest(const World& world, Entity organ) {
  const Resting* resting = world.find<Resting>(organ);
  return resting && resting->still >= frames_to_rest(world) && !world.find<Pulse>(organ) &&
         !is_link_loaded(world, organ) && !has_tools(world, organ);
}

/// As an organ comes to rest.
void note_poses(World& world, Entity organ) {
  const Pool<OrganPair>& pairs = world.all<OrganPair>();
  for (std::size_t p = 0; p < pairs.size(); ++p)
    if (std::ranges::find(pairs[p].organs, organ) != pairs[p].organs.end())
      world.find<PairState>(pairs.owner(p))->apart_at_rest = apart(world, pairs[p].organs);
}

}  // namespace

bool rests(const World& world, Entity organ) {
  const Resting* resting = world.find<Resting>(organ);
  return resting && resting->rests;
}

bool both_rest(const World& world, const std::array<Entity, 2>& organs) {
  bool any = false;
  for (const Entity organ : organs) {
    if (rests(world, organ))
      any = true;
    else if (yields(world, organ))
      return false;
  }
  return any;
}

bool pair_rests(const World& world, Entity entity) {
  const OrganPair& pair = *world.find<OrganPair>(entity);
  return both_rest(world, pair.organs) &&
         (apart(world, pair.organs) - world.find<PairState>(entity)->apart_at_rest).norm() <
             kUnmoved;
}

bool all_at_rest(const World& world) {
  const AllAtRest* all = world.one<AllAtRest>();
  if (!all || !all->known || !std::ranges::all_of(world.all<Resting>(), &Resting::rests))
    return false;
  const std::vector<Entity>& organs = world.model().organs();
  return std::ranges::equal(organs, all->positions, {},
                            [&](Entity organ) { return pose_of(world, organ).position; });
}

void note_all_at_rest(World& world) {
  const Pool<OrganPair>& pairs = world.all<OrganPair>();
  AllAtRest& all = *world.one<AllAtRest>();
  all.known =
      std::ranges::all_of(world.all<Resting>(), &Resting::rests) &&
      std::ranges::all_of(pairs.owners(), [&](Entity pair) { return pair_rests(world, pair); });
  if (!all.known) return;
  all.positions.clear();
  for (const Entity organ : world.model().organs())
    all.positions.push_back(pose_of(world, organ).position);
}

void wake(World& world, Entity organ) {
  const std::int32_t group = world.find<Resting>(organ)->group;
  for (Resting& one : world.all<Resting>()) {
    if (!one.rests || one.group != group) continue;
    one.rests = false;
    one.group = -1;
    one.still = 0;
  }
}

void wake_disturbed(World& world) {
  const Pool<Resting>& all = world.all<Resting>();
  for (std::size_t o = 0; o < all.size(); ++o)
    if (all[o].rests && is_disturbed(world, all.owner(o), all[o])) wake(world, all.owner(o));
}

void let_rest(World& world) {
  Pool<Resting>& all = world.all<Resting>();
  const std::int32_t long_enough = frames_to_rest(world);
  bool any = false;
  for (std::size_t o = 0; o < all.size(); ++o) {
    const std::uint64_t version = world.find<OrganState>(all.owner(o))->version;
    const bool same = std::exchange(all[o].version, version) == version;
    all[o].still = same ? std::min(all[o].still + 1, long_enough) : 0;
    any = any || (!all[o].rests && all[o].still == long_enough);
  }
  if (!any) return;
  for (const Island& island : islands_of(world)) {
    if (!std::ranges::all_of(island.organs, [&](Entity organ) { return may_rest(world, organ); }))
      continue;
    for (const Entity organ : island.organs) {
      Resting& resting = *world.find<Resting>(organ);
      resting.rests = true;
      resting.group = static_cast<std::int32_t>(island.organs.front().index);
      resting.weight = weight_on(world, organ);
      resting.stiffenings = stiffenings_of(world, organ);
    }
    for (const Entity organ : island.organs) note_poses(world, organ);
  }
}

}  // namespace viscera
