// Triangles of polygons with holes, as cut triangles of a surface are.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "kernels/base/types.h"

namespace viscera {

/// The corners of a polygon, indices into its places, in turn: anticlockwise about what is in it,
/// clockwise around a hole.
using PolygonLoop = std::vector<int>;

/// Twice the area within it; negative where it goes clockwise.
double doubled_area(std::span<const Vec2> places, const PolygonLoop& loop);
bool lies_within(std::span<const Vec2> places, const PolygonLoop& loop, const Vec2& place);

/// By cutting off ears, the best-shaped first. Triangles go anticlockwise and use all corners and
/// no others. `loops`: the outer one first. Where rounding leaves no ear, those that are least
/// turned over are cut off.
std::vector<std::array<int, 3>> polygon_triangles(std::span<const Vec2> places,
                                                  const std::vector<PolygonLoop>& loops);

}  // namespace viscera
