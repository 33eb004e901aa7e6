// Bodies with exact shapes, for comparison with analytic solutions.
#pragma once

#include <optional>

#include "kernels/base/result.h"
#include "kernels/points/surface.h"

namespace viscera {

/// Each takes the wanted `edge` [m] of its triangles, or their exact number (even, at least 20).
Result<TriangleSurface> sphere_surface(double radius, double edge, std::optional<int> triangles);
/// Flat base at z = 0, pole up; the rim is sharp and its vertices lie on it.
Result<TriangleSurface> hemisphere_surface(double radius, double edge,
                                           std::optional<int> triangles);
/// Axis-aligned, centred at the origin; sharp edges, flat faces.
Result<TriangleSurface> block_surface(const Vec3& size, double edge, std::optional<int> triangles);

}  // namespace viscera
