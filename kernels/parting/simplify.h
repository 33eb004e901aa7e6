// Fewer triangles for a surface that has more than its shape needs, as what marches through voxels
// has on flat walls.
#pragma once

#include "kernels/points/surface.h"

namespace viscera {

struct Simplification {
  double tolerance =
      0.0;  ///< of a vertex from the planes that it stands for, root of the mean square [m]
  double longest = 0.0;  ///< no side is made longer [m]
};

/// Sides fall in on a place between their ends, the least error first [Garland1997]. The surface
/// stays closed and manifold, no triangle turns over, and none becomes narrower than a fiftieth of
/// its length that wasn't before.
TriangleSurface simplified(const TriangleSurface& surface, const Simplification& wanted);

}  // namespace viscera
