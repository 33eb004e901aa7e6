// What of a surface hangs together, and the separate bodies that it encloses.
#pragma once

#include <array>
#include <vector>

#include "kernels/points/surface.h"

namespace viscera {

/// Its triangles, apart where they share no vertex; in the order of their first ones.
std::vector<std::vector<std::array<int, 3>>> connected_triangles(const TriangleSurface& surface);

/// Parts of a surface that share no vertex, in the order of their first triangles; the wall of a
/// hollow goes with the body about it. Vertices stay numbered as they were. One piece where the
/// parts aren't closed each.
std::vector<TriangleSurface> closed_pieces(const TriangleSurface& surface);

}  // namespace viscera
