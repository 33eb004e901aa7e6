// Surfaces from files through assimp.
#pragma once

#include <filesystem>

#include "kernels/base/result.h"
#include "kernels/points/surface.h"

namespace viscera {

/// Reads every triangle of an OBJ, STL, PLY, glTF or GLB file with its node transforms, welds
/// vertices at the same place (STL and per-corner attributes split them), multiplies by `unit`
/// (metres per unit of the file). Doesn't judge the surface: surface_defects() does.
/// Fails for files that are missing, empty, truncated, of unknown format, or without triangles.
/// In this process, which a damaged file may end: import_surface() (foreign_files.h) asks another.
Result<TriangleSurface> import_surface_here(const std::filesystem::path& file, double unit);

}  // namespace viscera
