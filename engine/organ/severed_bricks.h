// What a cut takes off has no blood: which pieces of an organ that are, and the bricks of heat that
// they reach.
#pragma once

#include <span>
#include <vector>

#include "engine/organ/organ_model.h"
#include "kernels/heat/brick_geometry.h"
#include "kernels/paff/shape_functions.h"
#include "kernels/points/surface_tree.h"

namespace viscera {

/// Of each piece of a cut organ's surface (CutOrgan::pieces) the number, by LoosePieces, of what
/// moves it; -1: something holds it, or no node has any of it. Empty: all is held. `fields`: of
/// that body; `tree`: of its surface at rest.             (pieces)
std::vector<int> loose_of_pieces(const OrganModel& model, const ShapeFunctions& fields,
                                 const SurfaceTree& tree, std::span<const int> pieces);

/// Takes the blood from the tissue of pieces that are loose: in bricks of `shapes`, and in all
/// others that they reach, which are added. The nearest wall says which piece a voxel is of. Bricks
/// that are cut off as a whole, beside what is gone, are added without a geometry. `voxel`: of heat
/// [m]. Parallel, deterministic.
void take_blood(const TriangleSurface& surface, const SurfaceTree& tree,
                std::span<const int> pieces, std::span<const int> loose, double voxel,
                std::vector<ShapedBrick>& shapes);

}  // namespace viscera
