// Quadrature over the inside of a closed triangle surface: octree cells that follow the node
// spacing, cut exactly by the surface, with no inside test.
#pragma once

#include <cstddef>
#include <vector>

#include "kernels/base/result.h"
#include "kernels/paff/local_spacing.h"
#include "kernels/points/surface.h"

namespace viscera {

/// Points inside the body; the weights are positive and add up to the enclosed volume.
struct VolumeQuadrature {
  std::vector<Vec3> positions;  ///< [m]
  std::vector<double> weights;  ///< [m3]
  std::size_t cut_cells = 0;

  std::size_t size() const { return positions.size(); }
};

/// Cells with side at most h carry 2 x 2 x 2 Gauss points; cells that the surface cuts are halved
/// to at most h/2 and carry one point, at the exact centroid of the part inside with its exact
/// volume. Volume and first moments of the body are met to round-off.
/// Fails where a cell finds that the surface isn't closed or is inside-out.
Result<VolumeQuadrature> background_quadrature(const TriangleSurface& surface,
                                               const LocalSpacing& spacing);

}  // namespace viscera
