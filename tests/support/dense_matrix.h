// A sparse matrix put together in full, for small bodies.
#pragma once

#include <vector>

#include "kernels/base/types.h"
#include "kernels/paff/block_matrix.h"

namespace viscera {

inline MatrixX dense(const SymmetricBlockMatrix& matrix) {
  const auto n = static_cast<Eigen::Index>(3 * matrix.pattern.rows());
  MatrixX whole(n, n);
  for (Eigen::Index c = 0; c < n; ++c) {
    std::vector<double> unit(static_cast<std::size_t>(n), 0.0), column(unit);
    unit[static_cast<std::size_t>(c)] = 1.0;
    matrix.multiply(unit, column);
    whole.col(c) = Eigen::Map<const VectorX>(column.data(), n);
  }
  return whole;
}

}  // namespace viscera
