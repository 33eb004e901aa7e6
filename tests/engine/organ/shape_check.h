// What every shape that the program builds must be.
#pragma once

#include <string>

#include "engine/organ/shape.h"

namespace viscera::test {

/// The project's shape of this geometry; a test failure, and no triangles, where it can't be built.
TriangleSurface built(const RecipeGeometry& geometry);

/// surface_defects() in one string; "" for a sound surface.
std::string defects(const TriangleSurface& surface);

/// The least angle of any triangle [degrees].
double least_angle_degrees(const TriangleSurface& surface);

/// Edge of the equilateral triangle of the mean area [m].
double mean_edge(const TriangleSurface& surface);

/// Greatest |distance| at a vertex [m].
double greatest_offset(const TriangleSurface& surface, const SignedDistance& distance);

/// Hash of all vertices and triangles.
std::string content_hash(const TriangleSurface& surface);

}  // namespace viscera::test
