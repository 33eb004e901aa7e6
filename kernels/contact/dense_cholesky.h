// Cholesky factorisation of the small dense matrices of contact.
#pragma once

#include <Eigen/Cholesky>

#include "kernels/base/types.h"

namespace viscera {

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
