// The pressure of an incompressible gas: a Poisson equation on the cells that gas fills, by
// conjugate gradients with one V-cycle of multigrid as preconditioner, as [McAdams2010] do.
#pragma once

#include <span>
#include <vector>

#include "kernels/smoke/gas_layout.h"

namespace viscera {

/// A x = b for (A x)_c = sum over its six faces of w_f (x_c - x_neighbour). w_f [1/m2] is 1/h^2 for
/// a face that gas passes and 0 for a wall; ghosts hold x = 0, so a weight on the domain's side
/// opens it to the outside. Symmetric, at least semi-definite: gas that nothing opens has its
/// pressure up to a constant, and b must sum to zero over it.
///
/// Coarse grids join two cells along each axis and open a face by the sum of what it joins, halved
/// for the double distance: walls thinner than a coarse cell stay walls as far as they can, and a
/// closed region stays closed. Same digits for any number of threads.
class GasPressure {
 public:
  struct Outcome {
    int iterations = 0;
    double residual = 0.0;   ///< root of the sum of squares over cells, at the end
    bool converged = false;  ///< to what was asked
  };

  GasPressure() = default;
  explicit GasPressure(const std::array<int, 3>& cells);

  const GasLayout& layout() const { return levels_.front().layout; }
  std::size_t levels() const { return levels_.size(); }

  /// Sets the weights w_f and those of the coarse grids.
  void set_openings(const GasFaces& faces);

  /// Improves x until the residual's root of the sum of squares is at most `tolerance`. The guess
  /// in x is dropped if it is worse than 0. Cells without any open face have no equation. b and x
  /// have layout().count; x is 0 in ghosts.
  Outcome solve(std::span<const float> b, std::span<float> x, double tolerance, int most = 100);

  void apply(std::span<const float> x, std::span<float> y) const;  ///< y = A x in the cells
  /// z = M r with M near the inverse of A, symmetric: what preconditions.
  void precondition(std::span<const float> r, std::span<float> z);

 private:
  struct Level {
    GasLayout layout;
    GasFaces face;                // w_f
    std::vector<float> diagonal;  // of A
    std::vector<float> inverse;   // of the diagonal; 0 where that is 0
    std::vector<float> x, y, b;   // of the V-cycle
  };

  void coarsen(const Level& fine, Level& coarse) const;
  void cycle(std::size_t level);

  std::vector<Level> levels_;
  MatrixX coarsest_;          // pseudo-inverse of the last level
  std::vector<float> p_, q_;  // direction, A times it
};

}  // namespace viscera
