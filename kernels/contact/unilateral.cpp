#include "kernels/contact/unilateral.h"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <limits>

namespace viscera {
namespace {

/// Blocks that may fail to lower the number of violated conditions before single exchanges begin.
constexpr int kPatience = 3;
/// Violations below this share of the greatest value of their kind are round-off.
constexpr double kRoundOff = 1e-11;
/// An active part with a reciprocal condition number below this has no inverse to speak of.
constexpr double kSingular = 1e-13;

/// Rayleigh quotients after a few steps of the power method, from the smoothest and the roughest
/// vector: the modes of contact are ordered by wavelength.
double power_method_ratio(const MatrixX& matrix, const DenseCholesky& factor) {
  const Eigen::Index n = matrix.rows();
  if (n == 0) return 1.0;
  VectorX smooth = VectorX::Ones(n), rough(n), image(n);
  for (Eigen::Index i = 0; i < n; ++i) rough[i] = (i % 2 == 0 ? 1.0 : -1.0) + 0.3 * ((i * 7) % 5);
  double largest = 1.0, inverse_smallest = 1.0;
  for (int step = 0; step < 5; ++step) {
    smooth.normalize();
    image.noalias() = matrix * smooth;
    largest = smooth.dot(image);
    smooth.swap(image);
    rough.normalize();
    image = rough;
    factor.solve_in_place(image);
    inverse_smallest = rough.dot(image);
    rough.swap(image);
  }
  return 1.0 / (inverse_smallest * largest);
}

}  // namespace

double smallest_eigenvalue_ratio(const MatrixX& matrix) {
  if (matrix.size() == 0) return 1.0;
  const MatrixX half = 0.5 * (matrix + matrix.transpose());
  const Eigen::SelfAdjointEigenSolver<MatrixX> solver(half, Eigen::EigenvaluesOnly);
  const VectorX& values = solver.eigenvalues();
  const double greatest = values.cwiseAbs().maxCoeff();
  return greatest > 0.0 ? values[0] / greatest : 0.0;
}

double estimated_eigenvalue_ratio(const MatrixX& matrix) {
  DenseCholesky factor;
  return factor.compute(matrix) ? power_method_ratio(matrix, factor)
                                : smallest_eigenvalue_ratio(matrix);
}

bool UnilateralSolver::solve_active(const MatrixX& matrix, const VectorX& b,
                                    std::span<const char> active, bool symmetric, VectorX& x) {
  indices_.clear();
  for (std::size_t i = 0; i < active.size(); ++i) {
    if (active[i]) indices_.push_back(static_cast<int>(i));
  }
  x.setZero(b.size());
  if (indices_.empty()) return true;
  // All active, which is how patches that stick always are: no copy.
  const bool whole = indices_.size() == active.size();
  if (!whole) part_ = matrix(indices_, indices_);
  if (symmetric && whole) {
    if (!factor_.compute(matrix)) return false;
    x = b;
    factor_.solve_in_place(x);
    return x.allFinite();
  }
  if (whole) part_ = matrix;
  if (!symmetric) {
    const Eigen::PartialPivLU<MatrixX> factor(part_);
    if (!(factor.rcond() > kSingular)) return false;
    const VectorX amounts = factor.solve(VectorX(b(indices_)));
    x(indices_) = amounts;
    return x.allFinite();
  }
  if (!factor_.compute(part_)) return false;
  VectorX amounts = b(indices_);
  factor_.solve_in_place(amounts);
  x(indices_) = amounts;
  return x.allFinite();
}

UnilateralFigures UnilateralSolver::solve(const MatrixX& matrix, const VectorX& b,
                                          std::span<const char> bilateral,
                                          std::vector<char>& active, VectorX& x, bool symmetric,
                                          bool same_matrix) {
  UnilateralFigures figures;
  const auto n = static_cast<std::size_t>(b.size());
  for (std::size_t i = 0; i < n; ++i) active[i] = active[i] || bilateral[i];

  if (!same_matrix) measured_.clear();
  x.setZero(b.size());
  figures.smallest_eigenvalue = 0.0;
  if (!b.allFinite() || (!same_matrix && !matrix.allFinite())) return figures;

  std::size_t fewest = n + 1;
  int patience = kPatience;
  // Exchanges of a fixed order end after finitely many steps, in practice a few an unknown; the
  // bound is for matrices that aren't positive, or lost it to round-off.
  const std::size_t most_rounds = 100 + 10 * n;
  for (std::size_t round = 0; round < most_rounds; ++round) {
    if (!solve_active(matrix, b, active, symmetric, x)) break;
    residual_.noalias() = matrix * x - b;
    const double force_floor = kRoundOff * x.cwiseAbs().maxCoeff();
    const double gap_floor =
        kRoundOff * std::max(b.cwiseAbs().maxCoeff(), (residual_ + b).cwiseAbs().maxCoeff());
    std::size_t violated = 0;
    std::size_t last = n;
    for (std::size_t i = 0; i < n; ++i) {
      const auto at = static_cast<Eigen::Index>(i);
      if (bilateral[i]) continue;
      if (active[i] ? x[at] < -force_floor : residual_[at] < -gap_floor) {
        ++violated;
        last = i;
      }
    }
    if (violated == 0) {
      for (std::size_t i = 0; i < n; ++i) {
        auto& amount = x[static_cast<Eigen::Index>(i)];
        if (!bilateral[i]) amount = std::max(0.0, amount);
      }
      figures.converged = true;
      if (!same_matrix || indices_ != measured_ || measured_.empty()) {
        const bool whole = indices_.size() == n;
        measured_eigenvalue_ = !symmetric ? smallest_eigenvalue_ratio(matrix(indices_, indices_))
                                          : power_method_ratio(whole ? matrix : part_, factor_);
        measured_ = indices_;
      }
      figures.smallest_eigenvalue = measured_eigenvalue_;
      return figures;
    }
    const bool whole_block = violated < fewest || patience > 0;
    if (violated < fewest) {
      fewest = violated;
      patience = kPatience;
    } else {
      --patience;
    }
    for (std::size_t i = whole_block ? 0 : last; i <= last; ++i) {
      const auto at = static_cast<Eigen::Index>(i);
      if (bilateral[i]) continue;
      if (active[i] ? x[at] < -force_floor : residual_[at] < -gap_floor) {
        active[i] = !active[i];
        ++figures.pivots;
      }
    }
  }
  x.setZero();
  return figures;
}

}  // namespace viscera
