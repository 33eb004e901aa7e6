// The separate bodies that one surface encloses.
#pragma once

#include <vector>

#include "kernels/points/surface.h"

namespace viscera {

/// Parts of a surface that share no vertex, in the order of their first triangles; the wall of a
/// hollow goes with the body about it. Vertices stay numbered as they were. One piece where the
/// parts aren't closed each.
std::vector<TriangleSurface> closed_pieces(const TriangleSurface& surface);

}  // namespace viscera
