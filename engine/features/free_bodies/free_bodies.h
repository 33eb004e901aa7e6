// Organs that nothing holds: they fall, slide on what they touch, and come to rest there.
//
// Such a body is one at finite strain whose displacements are its fall, too: mass alone withstands
// it within a step, so that what preconditions is well posed without a hold, and the rotations that
// warp it follow it as it turns. All of gravity acts on it. Meeting others (touching.h) is what
// stops it.
#pragma once

#include "engine/features/free_bodies/free_bodies_flags.h"
#include "engine/simulation/feature.h"

namespace viscera {

struct FreeBody {
  static constexpr std::string_view kName = "free bodies";
  double gone_at = -1.0;  ///< when it fell out of view, to stay there; below 0: it hasn't [s]
  static constexpr auto fields() { return std::tuple(field("gone_at", &FreeBody::gone_at)); }
};
static_assert(fields_cover<FreeBody>());

/// Whether all of it falls, or pieces that a cut has taken off it do.
bool is_loose(const World& world, Entity organ);
/// Whether it has fallen out of view.
bool is_gone(const World& world, Entity organ);

/// How two organs, or pieces of one, come nearer within some time.
struct Coming {
  Vec3 way = Vec3::Zero();  ///< of the first beside the second, by the means of their nodes, world
                            ///< [m]
  double besides = 0.0;     ///< what nodes of both do besides these means, at most [m]
  bool as_ones = true;      ///< false: pieces of them go their own ways, of which means say nothing

  double at_most() const { return way.norm() + besides; }
  /// To a place of the second with this normal outward: as far as the means go; a part of what goes
  /// along it counts, too, as it may meet a place that is turned otherwise. Pieces: at_most().
  double towards(const Vec3& normal) const;
};

/// As what of them nothing holds goes and falls now; zero where all is held.
Coming way_to_come(const World& world, Entity one, Entity other, double time);
/// Where the first of two organs goes beside the second within so long, by the mean of their nodes
/// as they go and fall now, world [m]; zero where neither is a free body, or they go slower than
/// one falls within that time: what lies on something doesn't fall.
Vec3 coming_way(const World& world, Entity one, Entity other, double time);

Feature free_bodies_feature();

}  // namespace viscera
