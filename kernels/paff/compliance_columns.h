// The surface compliance of any formulation, column block by column block.
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

/// What ElasticSolver::compliance promises. `symmetric`: the stiffness is, so the touchable square
/// is made exactly its own mirror (round-off differs above and below the diagonal); otherwise it is
/// left as it is.
Result<SurfaceCompliance> compliance_columns(std::size_t node_count, std::vector<int> visible,
                                             std::vector<int> touchable, bool symmetric,
                                             const UnitSolver& solve_units,
                                             const Progress& progress);

}  // namespace viscera
