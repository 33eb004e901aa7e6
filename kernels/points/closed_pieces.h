// What of a surface hangs together, and the separate bodies that it encloses.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "kernels/points/surface.h"

namespace viscera {

/// Its triangles, apart where they share no vertex; in the order of their first ones.
std::vector<std::vector<std::array<int, 3>>> connected_triangles(const TriangleSurface& surface);

/// Parts of a surface that share no vertex, in the order of their first triangles; the wall of a
/// hollow goes with the body about it. Vertices stay numbered as they were. One piece where the
/// parts aren't closed each.
std::vector<TriangleSurface> closed_pieces(const TriangleSurface& surface);

/// Of each vertex the number of the closed piece that it is of; empty: there is one.           (V)
std::vector<int> pieces_of_vertices(const TriangleSurface& surface,
                                    const std::vector<TriangleSurface>& pieces);
/// By pieces_of_vertices(), of a triangle; 0 where there is one.
inline int piece_of(std::span<const int> pieces, const TriangleSurface& surface, int triangle) {
  if (pieces.empty()) return 0;
  const int corner = surface.triangles[static_cast<std::size_t>(triangle)][0];
  return pieces[static_cast<std::size_t>(corner)];
}

}  // namespace viscera
