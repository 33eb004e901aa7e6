// Sparse Cholesky factorisation by MUMPS [Amestoy2001], in double precision, with many right-hand
// sides at once.
#pragma once

#include <cstddef>
#include <span>
#include <string_view>

#include "kernels/base/result.h"
#include "kernels/paff/block_matrix.h"
#include "kernels/paff/mumps_factor.h"

namespace viscera {

/// The factor of one symmetric positive definite matrix; movable. Threads: see MumpsFactor.
class SparseCholesky {
 public:
  /// `what` names the matrix in messages. `shift` is added to the diagonal. Fails on a matrix that
  /// is singular or not positive definite, and when memory runs out.
  static Result<SparseCholesky> factor(const SymmetricBlockMatrix& matrix, double shift,
                                       std::string_view what);

  /// A x = b in place; `columns` right-hand sides, column-major (order x columns).
  Result<void> solve(std::span<double> right_hand_sides, int columns);

  std::size_t order() const { return factor_.order(); }                ///< rows of the matrix
  std::size_t factor_bytes() const { return factor_.factor_bytes(); }  ///< memory it holds

 private:
  explicit SparseCholesky(MumpsFactor factor) : factor_(std::move(factor)) {}
  MumpsFactor factor_;
};

}  // namespace viscera
