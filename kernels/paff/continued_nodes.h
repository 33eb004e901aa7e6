// A body that goes on as another one of the same nodes, as after a cut: which node goes on as
// which.
#pragma once

#include <vector>

#include "kernels/paff/shape_functions.h"

namespace viscera {

/// Of each node that carries the fields `now`, twins included, the one of `before` that carried the
/// same tissue: a node itself; a twin that was there; for a new twin what it was split off from.
/// Both are of the same nodes, apart from their twins.
std::vector<int> continued_nodes(const ShapeFunctions& before, const ShapeFunctions& now);

}  // namespace viscera
