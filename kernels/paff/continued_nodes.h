// A body that goes on as another one of the same nodes, as after a cut: which node goes on as
// which.
#pragma once

#include <vector>

#include "kernels/paff/shape_functions.h"
#include "kernels/points/surface_tree.h"

namespace viscera {

/// Nodes without their twins, which come after them.
std::size_t own_nodes(const ShapeFunctions& fields);

/// Of each node that carries the fields `now`, twins included, the one of `before` that carried the
/// same tissue: a node itself; a twin that was there; for a new twin what it was split off from.
/// Both are of the same nodes, apart from their twins.
std::vector<int> continued_nodes(const ShapeFunctions& before, const ShapeFunctions& now);

/// The same where whole pieces are gone, and with them nodes: those of `now`, twins apart, are some
/// of the nodes of `before`. A node that lies in air now, outside of the surface `left`, goes on as
/// what carried the tissue nearest to it: it may have been of a piece that is gone.
std::vector<int> continued_beside_gone_pieces(const ShapeFunctions& before,
                                              const ShapeFunctions& now, const SurfaceTree& left);

}  // namespace viscera
