// Pieces that are taken out of the scene: what a cut has taken off, nothing holds and a grasper or
// a bag has carried to its trocar leaves through it, if it fits.
//
// What has left is told by a place at rest within it. The organ becomes another body, without the
// closed surface about that place (engine/organ/cut_organ.h); until then the piece stays in the
// jaws, and blades leave it as it is.
#pragma once

#include <vector>

#include "engine/features/parting/parting.h"

namespace viscera {

/// Jaws nearer to their trocar than this bring out what they hold [m]. Chosen.
inline constexpr double kAtTrocar = 10e-3;

/// In a bag pieces up to so many times as wide as the bore are drawn out: soft tissue is squeezed,
/// or cut up in the bag. Chosen.
inline constexpr double kSqueezedInBag = 3.0;

/// Graspers and bags that have come to their trocars with pieces -> OrganCut::removed.
void remove_pieces(World& world, const FrameContext& context);

/// Of the first `count` pieces that were taken out a place at rest each [m].
std::vector<Vec3> places_removed(const OrganCut& cut, std::uint64_t count);
/// Numbers, as OrganLeft::pieces has them, of pieces that are taken out and that the organ's body
/// still has; of the first `count` that were.
std::vector<int> leaving_pieces(const World& world, Entity organ, std::uint64_t count);
/// Instruments let go of these pieces of an organ.
void let_go(World& world, Entity organ, const std::vector<int>& pieces);
/// The number, by LoosePieces, of what moves a piece of a cut organ; -1: it is held.
int loose_number(const OrganLeft& left, int piece);
/// Of what was to leave and no body was asked for without: what nothing holds any more stays.
void withdraw_dropped(World& world, Entity organ);
/// Fails on what a state that another program made may say of them; `bounds`: of the whole organ.
Result<void> check_removed(const OrganCut& cut, const Box& bounds);

/// How wide a hole must be for a body to come through along one of its principal axes: across that,
/// its greater extent, as it lies best [m].
double width_through_hole(const TriangleSurface& piece);

}  // namespace viscera
