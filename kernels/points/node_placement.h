// Nodes inside a closed surface by an advancing front, graded towards places of interest.
#pragma once

#include <functional>

#include "kernels/base/progress.h"
#include "kernels/base/result.h"
#include "kernels/points/cloud.h"
#include "kernels/points/surface_tree.h"

namespace viscera {

/// Wanted node spacing h(x) [m]; smooth, with a slope of about 0.25 at most; positive in the body
/// and within about h of it.
using SpacingField = std::function<double(const Vec3&)>;

/// h = min(h_max, h_min + gradient * distance to the nearest of `points`); h_max where none.
SpacingField graded_spacing(double h_max, double h_min, double gradient, std::vector<Vec3> points);

struct NodePlacement {
  double accept = 0.95;  ///< a candidate keeps accept * h from every node
  int sweeps = 20;       ///< repulsion sweeps after the front has closed
  std::uint64_t seed = 1;
  std::size_t max_nodes = 2'000'000;  ///< more is refused, with the number expected
};

/// Surface nodes first, then the interior, then repulsion sweeps (surface nodes slide on the
/// surface, interior nodes stay inside). Deterministic for a seed. Nodes keep at least 0.5 h from
/// each other, and interior nodes about h/2 from the surface. Fails with a clear message where
/// the spacing is not positive, or so coarse that fewer than 4 nodes result: the moment matrices of
/// moving least squares with a linear basis need four nodes in general position.
Result<PointCloud> place_nodes(const TriangleSurface& surface, const SurfaceTree& tree,
                               const SpacingField& spacing, const NodePlacement& options,
                               const Progress& progress);

/// Mean distance to the six nearest nodes, for each node [m].
std::vector<double> measure_spacings(const std::vector<Vec3>& positions);

}  // namespace viscera
