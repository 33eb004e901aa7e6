// Organs that touch themselves: loops that lie down on each other, folds that close.
//
// A patch of an organ looks for the nearest place of the same organ's drawn surface that faces it
// across air. What lies about the patch itself, and the far side of the wall that it belongs to,
// are no such places. Found, it is a meeting as of two organs (touching.h), with both ends in one.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "engine/collision/collision_surface.h"
#include "engine/features/touching/drawn_organ.h"

namespace viscera {

/// Of each patch of an organ that may touch itself.
struct FoldSides {
  static constexpr bool kConstant = true;
  std::vector<float> behind;  ///< what lies deeper inside is its own wall's far side [m]  (patches)
};

/// Behind each patch a share of the tissue's thickness there; `finder` finds on the surface at
/// rest.
FoldSides fold_sides(std::span<const SurfacePatch> patches, const CollisionSurface& finder);

/// Where on its own organ a patch is nearest to meeting something, within `farthest` ahead of it or
/// `behind` inside; `finder` finds on its drawn surface. Of two places that meet each other only
/// one finds the other, but where a fold lies along a certain way (same_fold).
std::optional<CollisionSurface::Hit> nearest_fold(const DrawnOrgan& organ,
                                                  const CollisionSurface& finder,
                                                  const SurfacePatch& patch, double behind,
                                                  double farthest);

/// Whether a patch that meets the place of another and one of there that meets this one's place say
/// the same.
bool same_fold(const SurfacePatch& one, const SurfacePatch& one_on, const SurfacePatch& other,
               const SurfacePatch& other_on);

}  // namespace viscera
