#pragma once

#include <cstddef>
#include <vector>

#include "kernels/points/surface.h"

namespace viscera {

/// The triangles' indices along a space-filling curve [Morton1966] through their middles: runs of
/// them lie together.
std::vector<std::size_t> triangles_along_curve(const TriangleSurface& surface);

}  // namespace viscera
