// Bodies put together from bricks: blocks, slit ones, leaves, pieces with gaps between them.
#pragma once

#include <functional>
#include <vector>

#include "kernels/points/surface.h"

namespace viscera {

/// The closed surface of the bricks between these lines (ascending) for which `filled` holds, asked
/// at their centres. Bricks must meet at whole faces or not at all.
TriangleSurface bricks(const std::vector<double>& x, const std::vector<double>& y,
                       const std::vector<double>& z,
                       const std::function<bool(const Vec3&)>& filled);

/// Lines from `from` to `to` no farther apart than `step`.
std::vector<double> lines(double from, double to, double step);

}  // namespace viscera
