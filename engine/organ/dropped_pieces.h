// Pieces of a cut organ that go with the cut: crumbs, and what was taken out of the scene.
#pragma once

#include <span>
#include <vector>

#include "kernels/paff/shape_functions.h"
#include "kernels/parting/carve.h"
#include "kernels/points/cloud.h"
#include "kernels/points/surface_tree.h"

namespace viscera {

/// Pieces that are too small for a node to stand for them, and those that were taken out.
struct Dropped {
  double crumbs = 0.0, removed = 0.0;  ///< [m3]
  std::vector<Box> boxes;              ///< about each of both
  std::size_t found = 0;               ///< of the places `removed`, those within pieces
};

/// Takes away closed pieces that are smaller than `least` [m3] and those about any of the places
/// `removed`; the only piece that there is stays.
Dropped drop_pieces(double least, std::span<const Vec3> removed, CarvedSurface& left);

/// Without the nodes that lie as far outside of the body with this surface, in spacings.
PointCloud nodes_about(const SurfaceTree& surface, const PointCloud& cloud, double far);

/// Without the nodes whose fields have none of this body: air hides all of it from them. `fields`:
/// of this cloud; where they don't cover the body, all of it.
PointCloud nodes_that_carry(const TriangleSurface& surface, const PointCloud& cloud,
                            const ShapeFunctions& fields);

}  // namespace viscera
