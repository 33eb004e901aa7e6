// Sparse Cholesky factorisation in double precision, with many right-hand sides at once: by MUMPS
// [Amestoy2001], or by Eigen in a build without it (sparse_cholesky_eigen.cpp), whose solutions
// differ in their last digits.
#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <string_view>

#include "kernels/base/result.h"
#include "kernels/paff/block_matrix.h"

namespace viscera {

/// The factor of one symmetric positive definite matrix; movable. Threads: one at a time; MUMPS's
/// calls queue for each other (mumps_factor.h).
class SparseCholesky {
 public:
  SparseCholesky(SparseCholesky&&) noexcept;
  SparseCholesky& operator=(SparseCholesky&&) noexcept;
  ~SparseCholesky();

  /// False: another library's factor, with other last digits.
  static bool is_by_mumps();

  /// `what` names the matrix in messages. `shift` is added to the diagonal. Fails on a matrix that
  /// is singular or not positive definite, and when memory runs out.
  static Result<SparseCholesky> factor(const SymmetricBlockMatrix& matrix, double shift,
                                       std::string_view what);

  /// A x = b in place; `columns` right-hand sides, column-major (order x columns).
  Result<void> solve(std::span<double> right_hand_sides, int columns);

  std::size_t order() const;         ///< rows of the matrix
  std::size_t factor_bytes() const;  ///< memory it holds

 private:
  struct Factor;
  explicit SparseCholesky(std::unique_ptr<Factor> factor);
  std::unique_ptr<Factor> factor_;
};

}  // namespace viscera
