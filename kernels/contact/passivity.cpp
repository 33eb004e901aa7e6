#include "kernels/contact/passivity.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>

#include "kernels/base/types.h"

namespace viscera {
namespace {

MatrixX symmetric_part(const SurfaceCompliance& compliance) {
  std::vector<std::size_t> rows;
  for (const int node : compliance.touchable) {
    const auto at = std::lower_bound(compliance.visible.begin(), compliance.visible.end(), node);
    for (std::size_t k = 0; k < 3; ++k)
      rows.push_back(3 * static_cast<std::size_t>(at - compliance.visible.begin()) + k);
  }
  const auto n = static_cast<Eigen::Index>(rows.size());
  MatrixX square(n, n);
  for (Eigen::Index j = 0; j < n; ++j)
    for (Eigen::Index i = 0; i < n; ++i)
      square(i, j) = compliance.columns[static_cast<std::size_t>(j) * compliance.rows() +
                                        rows[static_cast<std::size_t>(i)]];
  return 0.5 * (square + square.transpose());
}

}  // namespace

// Storing rounds each entry by a share of 2^-24, the mean of two mirrored ones by 2^-24 again: the
// matrix of these errors is in 2-norm at most 2^-23 of the Frobenius norm. So the least eigenvalue
// may be negative by that much, and no more. Whether C + 2^-23 |C| is positive is what a Cholesky
// factorisation tells.
double negative_compliance(const SurfaceCompliance& compliance) {
  constexpr double kRounding = 0x1.0p-23;
  MatrixX part = symmetric_part(compliance);
  const double size = part.norm();
  if (!std::isfinite(size)) return std::numeric_limits<double>::quiet_NaN();
  if (size == 0.0) return 0.0;
  part.diagonal().array() += kRounding * size;
  if (const Eigen::LLT<MatrixX> factor(part); factor.info() == Eigen::Success) return 0.0;
  part.diagonal().array() -= kRounding * size;
  const Eigen::SelfAdjointEigenSolver<MatrixX> modes(part, Eigen::EigenvaluesOnly);
  return modes.eigenvalues()[0] / size;
}

}  // namespace viscera
