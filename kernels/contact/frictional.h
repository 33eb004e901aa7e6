// Contact with Coulomb friction on a small dense compliance.
#pragma once

#include <span>
#include <vector>

#include "kernels/contact/contact_conditions.h"

namespace viscera {

struct FrictionFigures {
  int rounds = 0;          ///< Newton steps and blocks of sweeps
  bool converged = false;  ///< false: see FrictionSolver::solve
  double residual = 0.0;   ///< greatest violation of a condition, as a force over the greatest one
};

/// Solves A x = b + w under conditions on (x, w): semismooth Newton on the projections of the
/// conditions [Alart1991], with block Gauss-Seidel sweeps where a step doesn't lessen the residual.
/// Bounded, deterministic. A solution exists for every mu where A is positive definite, and is
/// the only one where mu is small; for large mu which one is found depends on the guess.
class FrictionSolver {
 public:
  /// `x` (in: a guess, or of another size: none). Not converged, x = 0: A or b isn't finite, a
  /// diagonal entry isn't positive, or the residual stays above 1e-9 of the greatest force and
  /// above its own round-off.
  FrictionFigures solve(const MatrixX& matrix, const VectorX& b,
                        std::span<const ContactCondition> conditions, VectorX& x);

 private:
  void evaluate(const MatrixX& matrix, const VectorX& b, const VectorX& x, VectorX& gaps,
                VectorX& residual) const;
  void build_slope(const MatrixX& matrix, const VectorX& x, const VectorX& gaps, MatrixX& slope);
  double round_off(const MatrixX& matrix, const VectorX& b, const VectorX& x) const;

  std::span<const ContactCondition> conditions_;
  VectorX step_of_;  // forces_of_gaps()
  VectorX gaps_, residual_, trial_, trial_gaps_, trial_residual_;
  MatrixX slope_;
};

}  // namespace viscera
