// Cholesky factorisation of the small dense matrices of contact.
#pragma once

#include <Eigen/Cholesky>

#include "kernels/base/types.h"

namespace viscera {

/// The first `pivots` columns of L for the `columns` columns at `a` (column-major, lower triangle,
/// `stride` apart, `rows` long), in place; the later columns become the Schur complement. Rows
/// below the square are right-hand sides, one a row: b becomes (L^-1 b) there. Column after column,
/// four earlier ones taken off at a time. False: not positive definite, or not finite.
bool partial_cholesky(double* a, Eigen::Index stride, Eigen::Index rows, Eigen::Index columns,
                      Eigen::Index pivots);
/// L^-1 x and L^-T x in place.
void solve_lower(const double* a, Eigen::Index stride, Eigen::Index n, double* x);
void solve_lower_transposed(const double* a, Eigen::Index stride, Eigen::Index n, double* x);

/// A = L L^T. Below some hundred unknowns a factorisation is all overhead in a general library;
/// this one is columns and wide registers, and hands larger matrices on. Keeps its memory.
class DenseCholesky {
 public:
  /// Reads the lower triangle; false: not positive definite, or not finite.
  bool compute(const MatrixX& matrix);
  /// A^-1 x in place; after a compute() that said true.
  void solve_in_place(VectorX& x) const;

 private:
  MatrixX lower_;
  Eigen::LLT<MatrixX> large_;
  bool is_large_ = false;
};

}  // namespace viscera
