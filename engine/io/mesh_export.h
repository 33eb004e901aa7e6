// Surfaces and nodes for other programs.
#pragma once

#include <string>

#include "kernels/points/cloud.h"
#include "kernels/points/surface.h"

namespace viscera {

/// The first line of what obj_text() writes: tells our files from other people's.
inline constexpr const char* kObjMark = "# written by viscera";

/// Wavefront OBJ in millimetres; `about` becomes comment lines.
std::string obj_text(const TriangleSurface& surface, const std::string& about);

/// PLY (ascii) of the nodes in millimetres: x, y, z, spacing, and surface (1 on the surface, 0
/// inside).
std::string nodes_ply_text(const PointCloud& cloud);

}  // namespace viscera
