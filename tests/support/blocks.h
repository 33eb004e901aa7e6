// Bodies put together from bricks: leaves, notches, pieces with gaps between them.
#pragma once

#include <functional>
#include <vector>

#include "kernels/points/surface.h"

namespace viscera::test {

/// The closed surface of the bricks between these lines (ascending) for which `filled` holds, asked
/// at their centres. Bricks must meet at whole faces or not at all.
TriangleSurface bricks(const std::vector<double>& x, const std::vector<double>& y,
                       const std::vector<double>& z,
                       const std::function<bool(const Vec3&)>& filled);

/// Lines from `from` to `to` no farther apart than `step`.
std::vector<double> lines(double from, double to, double step);

/// Two leaves of length x width x thickness `gap` apart along z, which `root` (its length along x,
/// from -root to 0) joins. Width about y = 0, the gap about z = 0. Edges no longer than `step`.
TriangleSurface leaves(const Vec3& size, double gap, double root, double step);

/// Two cubes `gap` apart along x, the first from -edge to 0.
TriangleSurface two_cubes(double edge, double gap, int divisions);

}  // namespace viscera::test
