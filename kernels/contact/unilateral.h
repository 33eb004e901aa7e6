// The complementarity problem of frictionless contact, on a small positive matrix.
#pragma once

#include <span>
#include <vector>

#include "kernels/base/types.h"
#include "kernels/contact/dense_cholesky.h"

namespace viscera {

/// What a solve found out about itself.
struct UnilateralFigures {
  int pivots = 0;          ///< exchanges between the active and the free set
  bool converged = false;  ///< false: not positive definite (symmetric), no solution found
                           ///< (unsymmetric), or not finite
  double smallest_eigenvalue =
      1.0;  ///< of the active part's symmetric half, relative to its largest; 1 when nothing is
            ///< active. Symmetric: an estimate from above, within some per cent, and positive.
            ///< Unsymmetric: exact, and not positive where the body could give out energy.
};

/// Smallest eigenvalue of (A + A^T) / 2 over its largest in size. 1 for an empty matrix.
double smallest_eigenvalue_ratio(const MatrixX& matrix);
/// The same of a symmetric matrix by a few steps of the power method: from above, within some per
/// cent, and several times cheaper. Not positive definite: as the other says.
double estimated_eigenvalue_ratio(const MatrixX& matrix);

/// Finds x with w = A x - b: x_i >= 0, w_i >= 0, x_i w_i = 0 where i is unilateral; w_i = 0 where
/// i is bilateral. Block principal pivoting [Judice1994], which settles in a few
/// factorisations; when blocks stop helping, exchanges of the last violated index alone
/// [Murty1988], which end for every matrix whose principal minors are positive, symmetric or not;
/// for others the number of rounds is bounded. Deterministic.
class UnilateralSolver {
 public:
  /// `active` (in: a guess; out: the final set) has the size of b; bilateral unknowns are always
  /// active. `x` is zero when the solve fails. `symmetric`: factored by Cholesky, else by LU.
  /// `same_matrix`: the matrix is that of the last call; where the active set is too, its smallest
  /// eigenvalue isn't measured again.
  UnilateralFigures solve(const MatrixX& matrix, const VectorX& b, std::span<const char> bilateral,
                          std::vector<char>& active, VectorX& x, bool symmetric = true,
                          bool same_matrix = false);

 private:
  bool solve_active(const MatrixX& matrix, const VectorX& b, std::span<const char> active,
                    bool symmetric, VectorX& x);

  std::vector<int> indices_;
  MatrixX part_;
  DenseCholesky factor_;
  std::vector<int> measured_;  // the active set whose smallest eigenvalue is known
  double measured_eigenvalue_ = 1.0;
  VectorX residual_;
};

}  // namespace viscera
