// The surface compliance of any solver of unit loads, column block by column block.
#pragma once

#include <functional>
#include <span>
#include <vector>

#include "kernels/base/progress.h"
#include "kernels/base/result.h"
#include "kernels/paff/elasticity.h"

namespace viscera {

/// Answers to unit loads: column k of `out` (3 N x units.size(), column-major) becomes the nodal
/// unknowns [m] under 1 N on unknown units[k].
using UnitSolver = std::function<Result<void>(std::span<const int> units, std::span<double> out)>;

/// A compliance of these nodes with columns still to be filled. Fails unless both lists ascend, are
/// within the nodes, and the visible nodes hold the touchable ones.
Result<SurfaceCompliance> empty_compliance(std::size_t node_count, std::vector<int> visible,
                                           std::vector<int> touchable, bool symmetric);

/// What ElasticSolver::compliance promises, for an unsymmetric stiffness: nothing is made
/// symmetric.
Result<SurfaceCompliance> compliance_columns(std::size_t node_count, std::vector<int> visible,
                                             std::vector<int> touchable,
                                             const UnitSolver& solve_units,
                                             const Progress& progress);

}  // namespace viscera
