// Whether a surface can carry a body: closed, oriented outwards, in one piece, without degenerate
// triangles. Each defect is named with the first place where it was seen.
#pragma once

#include <string>
#include <vector>

#include "kernels/points/surface.h"

namespace viscera {

/// Every defect of the surface in words, e.g. "open: 12 boundary edges, the first between vertices
/// 17 (1.2, 3.4, 5.6 mm) and 21 (...)"; empty when the surface is sound.
/// Checked: no triangles; indices out of range; non-finite coordinates; zero-area triangles; edges
/// with one triangle (open) or more than two (non-manifold); neighbours of opposite orientation;
/// negative volume (inside-out); more than one connected piece.
std::vector<std::string> surface_defects(const TriangleSurface& surface);

}  // namespace viscera
