// The surface compliance of any solver of many loads, column block by column block.
#pragma once

#include <functional>
#include <span>
#include <vector>

#include "kernels/base/progress.h"
#include "kernels/base/result.h"
#include "kernels/paff/elasticity.h"

namespace viscera {

/// Loads one after another, each a few numbers: load k is values[e] on unknown unknowns[e] for e in
/// [begin[k], begin[k + 1]).
struct SparseLoads {
  std::vector<int> begin{0};
  std::vector<int> unknowns;
  std::vector<double> values;  ///< [N]

  std::size_t size() const { return begin.size() - 1; }
};

/// Answers to loads: column k of `out` (3 N x loads.size(), column-major) becomes the nodal
/// unknowns [m] under load k. May change the loads.
using LoadSolver = std::function<Result<void>(SparseLoads& loads, std::span<double> out)>;

/// Displacements of all places [m] from nodal unknowns; `column` has three components a place.
void read_places(const SparseWeights& places, const double* unknowns, float* column);

/// A compliance of these places with columns still to be filled. Fails unless their nodes are below
/// `node_count` and the touchable ones ascend and are among them.
Result<SurfaceCompliance> empty_compliance(std::size_t node_count, const SparseWeights& places,
                                           std::vector<int> touchable, bool symmetric);

/// What ElasticSolver::compliance promises, for an unsymmetric stiffness: nothing is made
/// symmetric.
Result<SurfaceCompliance> compliance_columns(std::size_t node_count, const SparseWeights& places,
                                             std::vector<int> touchable, const LoadSolver& solve,
                                             const Progress& progress);

}  // namespace viscera
