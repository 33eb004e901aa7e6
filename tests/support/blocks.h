// Leaves and pieces of bricks (engine/verification/brick_surface.h) with gaps between them.
#pragma once

#include "engine/verification/brick_surface.h"

namespace viscera::test {

/// Two leaves of length x width x thickness `gap` apart along z, which `root` (its length along x,
/// from -root to 0) joins. Width about y = 0, the gap about z = 0. Edges no longer than `step`.
TriangleSurface leaves(const Vec3& size, double gap, double root, double step);

/// Two cubes `gap` apart along x, the first from -edge to 0.
TriangleSurface two_cubes(double edge, double gap, int divisions);

}  // namespace viscera::test
