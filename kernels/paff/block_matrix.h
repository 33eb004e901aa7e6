// Symmetric sparse matrices over pairs of nodes, and the loop that fills them row by row.
#pragma once

#include <cstddef>
#include <initializer_list>
#include <span>
#include <string_view>
#include <vector>

#include "kernels/base/parallel.h"
#include "kernels/base/result.h"
#include "kernels/paff/point_fields.h"

namespace viscera {

/// Which pairs of nodes (I, J >= I) share a point: the upper triangle with its diagonal.
struct SymmetricPattern {
  std::vector<std::size_t> row_begin{0};  ///< (N + 1)
  std::vector<int> columns;               ///< ascending in each row, the diagonal first

  std::size_t rows() const { return row_begin.size() - 1; }
};

/// Points where the product of two shape functions is integrated, and the way back from the nodes.
struct IntegrationPoints {
  const PointFields& fields;
  const NodeIncidence& incidence;
};

SymmetricPattern symmetric_pattern(std::size_t node_count,
                                   std::initializer_list<IntegrationPoints> sets);

/// A symmetric matrix of `width` x `width` blocks, each row-major; only J >= I is stored.
struct SymmetricBlockMatrix {
  SymmetricPattern pattern;
  int width = 1;
  std::vector<double> blocks;  ///< (pattern.columns.size() x width^2)

  /// out = A x for vectors of width * N numbers, node-major.
  void multiply(std::span<const double> x, std::span<double> out) const;
  /// Stored numbers if both triangles were.
  std::size_t nonzeros() const;
};

/// Rows of the matrix as solvers count them. Fails, naming `what`, unless there are 1 to 2^31 - 1.
Result<int> checked_order(const SymmetricBlockMatrix& matrix, std::string_view what);

/// The upper triangle with its diagonal, row by row of blocks: visit(row, column, value) of single
/// numbers, `shift` added to the diagonal.
template <class Visit>
void each_upper_entry(const SymmetricBlockMatrix& matrix, double shift, const Visit& visit) {
  const SymmetricPattern& pattern = matrix.pattern;
  const auto w = static_cast<std::size_t>(matrix.width);
  for (std::size_t row = 0; row < pattern.rows(); ++row) {
    for (std::size_t e = pattern.row_begin[row]; e < pattern.row_begin[row + 1]; ++e) {
      const auto column = static_cast<std::size_t>(pattern.columns[e]);
      for (std::size_t i = 0; i < w; ++i) {
        for (std::size_t j = column == row ? i : 0; j < w; ++j) {
          const bool diagonal = column == row && i == j;
          visit(row * w + i, column * w + j,
                matrix.blocks[e * w * w + i * w + j] + (diagonal ? shift : 0.0));
        }
      }
    }
  }
}

/// Rows as fixed chunks in parallel: body(row, slot) with slot[J] the place of column J in the
/// pattern, for the columns of that row. Each row is summed by one thread in the order of the
/// points, so the sums don't depend on the number of threads.
template <class Body>
void for_each_row(const SymmetricPattern& pattern, const Body& body) {
  parallel_chunks(pattern.rows(), 64, [&](std::size_t first, std::size_t last) {
    std::vector<std::size_t> slot(pattern.rows(), 0);
    for (std::size_t row = first; row < last; ++row) {
      for (std::size_t e = pattern.row_begin[row]; e < pattern.row_begin[row + 1]; ++e) {
        slot[static_cast<std::size_t>(pattern.columns[e])] = e;
      }
      body(row, std::span<const std::size_t>(slot));
    }
  });
}

}  // namespace viscera
