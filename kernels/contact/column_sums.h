// Sums of columns of a compliance, as fast as memory gives them.
#pragma once

#include <span>
#include <vector>

#include "kernels/base/types.h"

namespace viscera {

/// Columns of a compliance, three a place; column-major.
struct ColumnTriples {
  const float* values = nullptr;  ///< of the first row
  std::size_t rows = 0;
  std::size_t stride = 0;  ///< from a column to the next; rows or more
};

/// sums = sum_j (columns 3 t_j, 3 t_j + 1, 3 t_j + 2) loads_j over all rows;
/// `triples` holds the t_j. Single precision, in the order of j: parallel over rows, the same
/// digits for any number of threads.
void sum_column_triples(const ColumnTriples& columns, std::span<const int> triples,
                        std::span<const Vec3> loads, std::vector<float>& sums);

/// sums (rows x 3, column-major) = sum_j weights_j (columns 3 t_j, 3 t_j + 1, 3 t_j + 2): what unit
/// loads spread over the triples by these weights do. Likewise.
void sum_weighted_triples(const ColumnTriples& columns, std::span<const int> triples,
                          std::span<const double> weights, float* sums);

/// sums (rows x loads, column-major) += sum_j (columns 3 t_j, 3 t_j + 1, 3 t_j + 2) loads_j for
/// several loads (3 x triples) at once: a column is read once for all. By the thread that calls.
void add_column_triples(const ColumnTriples& columns, std::span<const int> triples,
                        std::span<const Eigen::Matrix3Xf> loads, float* sums);

}  // namespace viscera
