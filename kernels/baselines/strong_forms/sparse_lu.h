// Sparse LU factorisation by MUMPS [Amestoy2001], for the unsymmetric matrices of strong forms.
#pragma once

#include <cstddef>
#include <span>
#include <string_view>
#include <vector>

#include "kernels/base/result.h"
#include "kernels/base/types.h"
#include "kernels/paff/mumps_factor.h"

namespace viscera {

/// A matrix of 3 x 3 blocks in compressed rows; nothing is symmetric.
struct BlockRows {
  std::vector<std::size_t> row_begin{0};  ///< (N + 1)
  std::vector<int> columns;               ///< each once in a row
  std::vector<Mat3> blocks;

  std::size_t rows() const { return row_begin.size() - 1; }
  std::size_t nonzeros() const { return 9 * blocks.size(); }
  /// out = A x, vectors of 3 N numbers, node-major.
  void multiply(std::span<const double> x, std::span<double> out) const;
  /// b - A x, its sums in extended precision: for refinement.
  std::vector<double> residual(std::span<const double> b, std::span<const double> x) const;
};

/// The factor of one such matrix; movable. Threads: see MumpsFactor.
class SparseLu {
 public:
  /// `what` names the matrix in messages. Fails on a singular matrix and when memory runs out.
  static Result<SparseLu> factor(const BlockRows& matrix, std::string_view what);

  /// A x = b in place; `columns` right-hand sides, column-major (3 N x columns).
  Result<void> solve(std::span<double> right_hand_sides, int columns) {
    return factor_.solve(right_hand_sides, columns);
  }
  /// See MumpsFactor::solve_sparse.
  Result<void> solve_sparse(std::span<const int> begin, std::span<const int> rows,
                            std::span<const double> values, std::span<double> out) {
    return factor_.solve_sparse(begin, rows, values, out);
  }

  std::size_t factor_bytes() const { return factor_.factor_bytes(); }

 private:
  explicit SparseLu(MumpsFactor factor) : factor_(std::move(factor)) {}
  MumpsFactor factor_;
};

}  // namespace viscera
