// Organs that have come to rest on each other cost one test a frame: nothing of them is sought,
// solved or drawn until something disturbs one of those that rest together.
//
// An island rests once no drawn surface of it has changed for half a second. It wakes, as a whole,
// where a tool lies on one of its organs, weight, heat or what an organ touches goes another way
// than when it came to rest, or one that doesn't rest comes near.
#pragma once

#include <array>
#include <vector>

#include "engine/simulation/feature.h"
#include "kernels/base/fields.h"

namespace viscera {

/// Of an organ that others may touch, and that gives way.
struct Resting {
  static constexpr std::string_view kName = "resting organs";
  bool rests = false;
  std::int32_t group = -1;       ///< those with the same one rest on each other
  std::int32_t still = 0;        ///< frames in a row in which its surface hasn't changed
  std::uint64_t version = 0;     ///< OrganState::version of the last frame
  Vec3 weight = Vec3::Zero();    ///< that acts on it while it rests, organ frame [m/s2]
  std::int64_t stiffenings = 0;  ///< OrganChange::updates of then
  static constexpr auto fields() {
    using R = Resting;
    return std::tuple(field("rests", &R::rests), field("group", &R::group),
                      field("still", &R::still), field("version", &R::version),
                      field("weight", &R::weight), field("stiffenings", &R::stiffenings));
  }
};
static_assert(fields_cover<Resting>());

/// Where all organs' frames stood as every pair was seen to rest; of one entity, the whole.
struct AllAtRest {
  bool known = false;
  std::vector<Vec3> positions;  ///< world [m]                                       (organs)
};

bool rests(const World& world, Entity organ);
/// Whether both rest, or one does and the other never gives way.
bool both_rest(const World& world, const std::array<Entity, 2>& organs);
/// That, of a pair, and neither has been carried nearer to the other or away since.
bool pair_rests(const World& world, Entity pair);
/// That of all pairs: nothing has changed since note_all_at_rest() saw it, so that none is asked.
bool all_at_rest(const World& world);
/// Asks all pairs.
void note_all_at_rest(World& world);
/// An organ, and all that it rests with.
void wake(World& world, Entity organ);

/// Before organs look for each other: wakes what something other than they disturbs.
void wake_disturbed(World& world);
/// After that: counts frames without a change, and lets islands rest.
void let_rest(World& world);

}  // namespace viscera
