// The pieces of a body that no field joins, and which of them something holds.
#pragma once

#include <string>
#include <vector>

#include "kernels/paff/point_fields.h"
#include "kernels/paff/shape_functions.h"

namespace viscera {

/// Nodes whose fields meet at points of the volume, directly or by way of others.
struct TissuePiece {
  std::vector<int> nodes;  ///< of the fields' cloud, ascending
  bool held = false;
};

/// `volume` and `fixed`: the fields at the points of the volume, and at those of the surface that
/// are held. In the order of their first nodes; nodes whose fields reach no point of the volume
/// belong to none.
std::vector<TissuePiece> tissue_pieces(std::size_t node_count, const PointFields& volume,
                                       const PointFields& fixed);

/// Numbers of the pieces that nothing holds, from 0, of the nodes that they have; -1: of others.
/// (N)
std::vector<int> loose_pieces(const std::vector<TissuePiece>& pieces, std::size_t node_count);

/// Says how many pieces nothing holds, how many nodes the largest has and where; empty where all
/// are held. The first `own` nodes of the cloud lie where they are; the others, twins, in other
/// pieces.
std::string free_pieces_text(const std::vector<TissuePiece>& pieces, const PointCloud& cloud,
                             std::size_t own);

}  // namespace viscera
