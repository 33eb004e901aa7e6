// Multifrontal Cholesky factorisation [Duff1983] of a stiffness matrix, in single or double
// precision, over all threads, and many right-hand sides at once.
#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <string_view>
#include <vector>

#include "kernels/base/result.h"
#include "kernels/paff/dissection.h"

namespace viscera {

/// The factor of a symmetric positive definite matrix over the nodes of a body. Why not MUMPS: its
/// calls run one at a time and on one thread; here fronts of separate parts of the body, tiles of a
/// large front and blocks of right-hand sides run side by side, in fixed pieces and sums, so that
/// the result doesn't depend on the number of threads.
template <class Real>
class FrontalCholesky {
 public:
  /// Fails where a pivot isn't positive in this precision. `what` names the matrix in messages.
  static Result<FrontalCholesky> factor(const SymmetricBlockMatrix& matrix,
                                        std::shared_ptr<const Dissection> dissection,
                                        std::string_view what);

  /// From panels that were kept, one after another. Fails, in words that complete "rebuilt
  /// because", for another number of them than the fronts ask for.
  static Result<FrontalCholesky> of_panels(std::shared_ptr<const Dissection> dissection,
                                           std::span<const Real> panels);

  /// Which part of a solution is wanted or not zero, by front.
  using FrontMask = std::vector<char>;

  /// A X = B in place; `block` holds one right-hand side after another for each unknown: row-major
  /// (order x columns), unknowns in the order of elimination. Fronts that aren't `active` hold
  /// zeros in B and have no active children; solutions are computed at `wanted` fronts, whose
  /// parents are wanted too. Safe from many threads at once.
  void solve(std::vector<Real>& block, int columns, const FrontMask& active,
             const FrontMask& wanted) const;
  /// The same with every front active and wanted.
  void solve(std::vector<Real>& block, int columns) const;

  const Dissection& dissection() const { return *dissection_; }
  int width() const { return width_; }
  /// Columns of the factor at a front: (width * size) x (width * own), column-major, on and below
  /// the diagonal.
  const Real* panel(std::size_t front) const { return panels_[front].data(); }
  std::size_t panel_size(std::size_t front) const { return panels_[front].size(); }
  std::size_t factor_bytes() const { return entries_ * sizeof(Real); }

 private:
  FrontalCholesky() = default;

  std::shared_ptr<const Dissection> dissection_;
  int width_ = 3;
  std::size_t entries_ = 0;
  std::vector<std::vector<Real>> panels_;  // of each front: size x own, column-major
};

extern template class FrontalCholesky<float>;
extern template class FrontalCholesky<double>;

}  // namespace viscera
