// A first, closed but irregular triangulation of the zero set of a field.
#pragma once

#include "engine/organ/shape.h"

namespace viscera {

/// Marching tetrahedra [Doi1991] over a grid of cells of about `cell` [m], refined from coarse to
/// fine near the zero set. Closed, oriented outwards, manifold (what marching cubes and dual
/// methods don't promise); every piece of {distance < 0}. Fails where the body leaves the box, or
/// isn't there.
Result<TriangleSurface> marching_tetrahedra(const SignedDistance& distance, const Box& box,
                                            double cell);

/// The pieces of a closed surface that are joined by edges, greatest volume first; cavities have
/// negative volumes.
std::vector<TriangleSurface> pieces_of(const TriangleSurface& surface);

}  // namespace viscera
