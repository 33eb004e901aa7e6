// Dense Cholesky factorisation in tiles of fixed size, over all threads.
#pragma once

#include <cstddef>

namespace viscera {

/// The first k of m unknowns of a symmetric matrix are eliminated. `panel` (m x k, column-major,
/// leading dimension m) holds its first k columns, on and below the diagonal, and becomes their
/// factor; `rest` ((m - k) x (m - k), leading dimension m - k) holds the lower triangle of the
/// other columns, and becomes their Schur complement. Above the diagonals nothing is meant.
/// False where a pivot isn't positive. The result doesn't depend on the number of threads.
template <class Real>
bool eliminate(std::size_t m, std::size_t k, Real* panel, Real* rest);

}  // namespace viscera
