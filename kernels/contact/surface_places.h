// The places of a body's surface at which it is touched and seen: one for about every surface node.
#pragma once

#include <memory>
#include <vector>

#include "kernels/base/result.h"
#include "kernels/paff/shape_functions.h"
#include "kernels/paff/tissue_paths.h"
#include "kernels/points/surface.h"

namespace viscera {

/// Patches that divide a surface, each with one place standing for it: loads are spread over
/// places, displacements are read there and carried on to the drawn surface. What lies between
/// places is finer than the nodes resolve, so that more of them would bring nothing.
struct SurfacePlaces {
  std::vector<Vec3> positions;   ///< rest, centre of the patch, on the surface [m]   (P)
  std::vector<Vec3> normals;     ///< outward, unit, mean of the patch                (P)
  std::vector<double> areas;     ///< [m2]                                            (P)
  std::vector<double> spacings;  ///< local node spacing h [m]                        (P)
  SparseWeights fields;          ///< phi_J at each place; columns are nodes     (P rows)
  std::size_t nodes = 0;         ///< of the fields, twins with them
  /// What tells places on both sides of a fold apart (same_side.h); null: there is no fold.
  std::shared_ptr<const TissuePaths> paths;

  std::size_t size() const { return positions.size(); }
};

/// Divides `surface` among the surface nodes of the fields' cloud, the nearest having each part;
/// a part that bends by more than 45 degrees (an edge, the two sides of a thin wall), or that air
/// divides, becomes several. Fails where the fields don't cover a place. Parallel, deterministic.
Result<SurfacePlaces> place_on_surface(const TriangleSurface& surface,
                                       const ShapeFunctions& fields);

}  // namespace viscera
