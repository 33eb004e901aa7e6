// Sums of columns of a compliance, as fast as memory gives them.
#pragma once

#include <span>
#include <vector>

#include "kernels/base/types.h"

namespace viscera {

/// sums = sum_j (columns 3 t_j, 3 t_j + 1, 3 t_j + 2) loads_j over `rows` rows; `columns` is
/// column-major, `triples` holds the t_j. Single precision, in the order of j: parallel over rows,
/// the same digits for any number of threads.
void sum_column_triples(const float* columns, std::size_t rows, std::span<const int> triples,
                        std::span<const Vec3> loads, std::vector<float>& sums);

/// sums (rows x 3, column-major) = sum_j weights_j (columns 3 t_j, 3 t_j + 1, 3 t_j + 2): what unit
/// loads spread over the triples by these weights do. Likewise.
void sum_weighted_triples(const float* columns, std::size_t rows, std::span<const int> triples,
                          std::span<const double> weights, float* sums);

}  // namespace viscera
