// Nodes by an advancing front: on the surface first, then inwards from it [Slak2019].
#pragma once

#include "kernels/points/node_placement.h"

namespace viscera {

/// Nodes while they are being placed; the first `surface_count` lie on the surface.
struct PlacedNodes {
  std::vector<Vec3> positions;  ///< [m]                                                  (N)
  std::vector<double> wanted;   ///< wanted spacing h there [m]                           (N)
  std::vector<double> depths;   ///< at most the distance below the surface [m]; 0 on it  (N)
  std::size_t surface_count = 0;
};

/// What every stage of placing nodes works on.
struct PlacementTask {
  const TriangleSurface& surface;
  const SurfaceTree& tree;
  const SpacingField& spacing;
  const NodePlacement& options;
  double expected_nodes;  ///< estimate_nodes(), for the progress
};

/// Interior nodes keep this share of h from the surface.
inline constexpr double kDepthShare = 0.5;

/// About how many nodes the front will place: the integrals of h^-2 over the surface and of h^-3
/// over the volume. Within about a fifth where h varies slowly. Fails where h is not positive.
Result<double> estimate_nodes(const TriangleSurface& surface, const SurfaceTree& tree,
                              const SpacingField& spacing);

/// The refusal of more nodes than allowed.
Error too_many_nodes(double expected, std::size_t most);

/// Covers the surface: no place on it is left where another node would fit.
Result<PlacedNodes> cover_surface(const PlacementTask& task);

/// Fills the inside from the surface nodes. `progress` runs from 0 to 1.
Result<void> fill_inside(const PlacementTask& task, PlacedNodes& nodes, const Progress& progress);

}  // namespace viscera
