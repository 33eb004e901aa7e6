// The walls of what is gone from an organ.
#pragma once

#include "kernels/parting/tissue_share.h"
#include "kernels/points/surface.h"

namespace viscera {

/// Where half of the tissue is left: the closed surface of what is gone, oriented out of it, by
/// marching tetrahedra [Doi1991] between the middles of voxels. Closed and manifold whatever the
/// shares are; no triangle is narrower than a fiftieth of a voxel by much. Empty where nothing is
/// gone.
TriangleSurface void_surface(const TissueShare& tissue);

}  // namespace viscera
