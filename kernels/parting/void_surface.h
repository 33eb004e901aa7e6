// The walls of what is gone from an organ.
#pragma once

#include "kernels/parting/tissue_share.h"
#include "kernels/points/surface.h"

namespace viscera {

/// Where half of the tissue is left: the surface of what is gone, oriented out of it, by marching
/// tetrahedra between the middles of voxels. Closed and manifold whatever the shares are. Empty
/// where nothing is gone.
TriangleSurface void_surface(const TissueShare& tissue);
/// The same in as few triangles as its shape needs, within a tenth of a voxel, no side longer than
/// this [m].
TriangleSurface plain_void_surface(const TissueShare& tissue, double longest);

}  // namespace viscera
