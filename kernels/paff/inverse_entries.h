// Chosen entries of the inverse of a factored matrix.
#pragma once

#include <span>
#include <vector>

#include "kernels/paff/frontal_cholesky.h"

namespace viscera {

/// A^-1 = L^-T L^-1, so entries between sets of unknowns are products of columns of Y = L^-1. A
/// column of Y is zero but for the fronts above its own unknown, and a front sees only the columns
/// of its own part of the body: forward elimination and product go up the tree of fronts together,
/// and no back substitution is needed. For the surface of a body of 12,000 nodes that is a third of
/// the work of solving column by column.
///
/// `rows` and `columns` are positions in the order of elimination, ascending, `columns` among
/// `rows`. Returns A^-1 (w rows x w columns, column-major), w the width of the blocks. Entries
/// between two `columns` are symmetric but for round-off, or exactly where both sets are the same.
template <class Real>
std::vector<Real> inverse_entries(const FrontalCholesky<Real>& factor, std::span<const int> rows,
                                  std::span<const int> columns);

/// Multiplications that this takes; to be weighed against solving.
double inverse_entries_cost(const Dissection& dissection, int width, std::span<const int> rows,
                            std::span<const int> columns);

}  // namespace viscera
