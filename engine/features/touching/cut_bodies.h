// Organs that are cut meet others by patches of the body that they are, and their pieces each
// other.
//
// What met when an organ became another body meets afresh: it has other patches. Friction between
// the two begins anew then, with nothing that clings.
#pragma once

#include <optional>
#include <vector>

#include "engine/collision/collision_surface.h"
#include "engine/features/touching/drawn_organ.h"

namespace viscera {

/// Of an organ that has become another body by a cut; they count in place of OrganPatches.
struct CutPatches {
  std::vector<SurfacePatch> patches;
  bool cut = false;  ///< false: a state before the cut was loaded, and it is whole again
};
/// Of a pair of which one is such a one, in place of OrganPair::overlaps.
struct CutOverlaps {
  std::vector<float> overlaps;
};

/// Of the body that an organ is.
const std::vector<SurfacePatch>& patches_now(const World& world, Entity organ);
/// What the first organ of a pair brings: patches, or places of its edges, of which it has none as
/// a body that was cut: what cuts leave is ragged.
const std::vector<SurfacePatch>& brought_now(const World& world, Entity pair);
/// Of a pair, at rest.                                                                    (patches)
const std::vector<float>& overlaps_now(const World& world, Entity pair);

/// As Feature::replaced has it.
void meet_as_cut(World& world, Entity organ, const Continuation* continuation);

/// Of each vertex of an organ the piece of it that it is of; empty: it is one.                 (V)
const std::vector<int>& pieces_of(const World& world, Entity organ);

/// Where on its organ's drawn surface, within `farthest`, a patch is nearest to another piece. Of
/// two pieces the one with the higher number brings its patches.
std::optional<CollisionSurface::Hit> nearest_piece(const DrawnOrgan& organ,
                                                   const std::vector<int>& pieces,
                                                   const CollisionSurface& finder,
                                                   const SurfacePatch& patch, double farthest);

}  // namespace viscera
