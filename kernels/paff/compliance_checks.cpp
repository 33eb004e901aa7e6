#include "kernels/paff/compliance_checks.h"

#include <algorithm>
#include <cmath>
#include <sstream>
#include <vector>

#include "kernels/base/parallel.h"
#include "kernels/base/random.h"
#include "kernels/paff/blas.h"
#include "kernels/paff/tiled_cholesky.h"

namespace viscera {
namespace {

constexpr double kRoundOff = 1e-6;
/// Above this order a factor in double precision takes longer than it is worth, unless it decides.
constexpr std::size_t kDoubleBelow = 3000;

/// The symmetric part of the touchable square, of the unknowns that respond.
class SymmetricPart {
 public:
  explicit SymmetricPart(const SurfaceCompliance& compliance) : compliance_(compliance) {
    const std::vector<std::size_t> row_of = compliance.touchable_rows();
    for (std::size_t c = 0; c < row_of.size(); ++c) {
      const float diagonal = compliance.columns[c * compliance.rows() + row_of[c]];
      const float* column = compliance.columns.data() + c * compliance.rows();
      const bool responds =
          diagonal != 0.0f || std::any_of(row_of.begin(), row_of.end(),
                                          [&](std::size_t r) { return column[r] != 0.0f; });
      if (!responds) continue;
      columns_.push_back(c);
      rows_.push_back(row_of[c]);
    }
  }

  std::size_t order() const { return columns_.size(); }
  double operator()(std::size_t i, std::size_t j) const {
    const std::size_t height = compliance_.rows();
    return 0.5 * (static_cast<double>(compliance_.columns[columns_[j] * height + rows_[i]]) +
                  static_cast<double>(compliance_.columns[columns_[i] * height + rows_[j]]));
  }

  /// y = S x.
  void multiply(std::span<const double> x, std::span<double> y) const {
    // A column of C serves both terms of its row of S: C^T x directly, C x by the rows.
    const std::size_t n = order(), height = compliance_.rows();
    constexpr std::size_t kChunk = 64;
    std::vector<std::vector<double>> parts((n + kChunk - 1) / kChunk);
    parallel_chunks(n, kChunk, [&](std::size_t first, std::size_t last) {
      std::vector<double>& part = parts[first / kChunk];
      part.assign(n, 0.0);
      for (std::size_t j = first; j < last; ++j) {
        const float* column = compliance_.columns.data() + columns_[j] * height;
        double sum = 0.0;
        for (std::size_t i = 0; i < n; ++i) {
          const double entry = column[rows_[i]];
          sum += entry * x[i];
          part[i] += 0.5 * entry * x[j];
        }
        part[j] += 0.5 * sum;
      }
    });
    std::fill(y.begin(), y.end(), 0.0);
    for (const std::vector<double>& part : parts) {
      for (std::size_t i = 0; i < n; ++i) y[i] += part[i];
    }
  }

 private:
  const SurfaceCompliance& compliance_;
  std::vector<std::size_t> columns_, rows_;
};

/// Scales to length 1; returns the length.
template <class Real>
double normalise(std::vector<Real>& x) {
  double sum = 0.0;
  for (const Real value : x) sum += static_cast<double>(value) * static_cast<double>(value);
  const double length = std::sqrt(sum);
  if (length > 0.0) {
    for (Real& value : x) value = static_cast<Real>(static_cast<double>(value) / length);
  }
  return length;
}

template <class Real>
std::vector<Real> start(std::size_t n) {
  const Random random(11, 0);
  std::vector<Real> x(n);
  for (std::size_t i = 0; i < n; ++i) x[i] = static_cast<Real>(random.uniform(i) - 0.5);
  normalise(x);
  return x;
}

/// Largest eigenvalue of `sign` S + `shift` I, by iteration.
double largest_eigenvalue(const SymmetricPart& matrix, double sign, double shift, int steps) {
  std::vector<double> x = start<double>(matrix.order()), y(x.size());
  double value = 0.0;
  for (int step = 0; step < steps; ++step) {
    matrix.multiply(x, y);
    for (std::size_t i = 0; i < x.size(); ++i) y[i] = sign * y[i] + shift * x[i];
    x.swap(y);
    value = normalise(x);
  }
  return value;
}

/// 1 / largest eigenvalue of S^-1; not positive where S isn't, in this precision.
template <class Real>
double by_inverse_iteration(const SymmetricPart& matrix, double largest) {
  constexpr int kSteps = 12;
  const std::size_t n = matrix.order();
  const int order = static_cast<int>(n);
  std::vector<Real> factor(n * n);
  parallel_for_each_index(n, 16, [&](std::size_t j) {
    for (std::size_t i = j; i < n; ++i)
      factor[j * n + i] = static_cast<Real>(matrix(i, j) / largest);
  });
  if (!eliminate<Real>(n, n, factor.data(), nullptr)) return 0.0;
  std::vector<Real> x = start<Real>(n);
  double inverse = 0.0;
  for (int step = 0; step < kSteps; ++step) {
    blas::solve_right(true, 1, order, factor.data(), order, x.data(), 1);
    blas::solve_right(false, 1, order, factor.data(), order, x.data(), 1);
    inverse = normalise(x);
  }
  return inverse > 0.0 ? largest / inverse : 0.0;
}

}  // namespace

double smallest_compliance_eigenvalue(const SurfaceCompliance& compliance) {
  hold_blas_to_one_thread();
  const SymmetricPart matrix(compliance);
  if (matrix.order() == 0) return 1.0;
  // The largest in size may be a negative one.
  const double size = largest_eigenvalue(matrix, 1.0, 0.0, 12);
  if (!(size > 0.0) || !std::isfinite(size)) return -1.0;
  double smallest = 0.0;
  if (matrix.order() > kDoubleBelow) smallest = by_inverse_iteration<float>(matrix, size);
  if (!(smallest > 0.0)) smallest = by_inverse_iteration<double>(matrix, size);
  if (smallest > 0.0) return std::min(1.0, smallest / size);
  constexpr double kAboveAll = 1.1;  // the iteration approaches the largest from below
  const double shift = kAboveAll * size;
  return (shift - largest_eigenvalue(matrix, -1.0, shift, 80)) / size;
}

Result<void> expect_positive_compliance(double smallest_eigenvalue) {
  if (smallest_eigenvalue > -kRoundOff) return {};
  std::ostringstream text;
  text << "compliance: its smallest eigenvalue is " << smallest_eigenvalue
       << " of its largest; expected a positive one, since tissue would feed energy into the tool "
          "otherwise: use formulation \"galerkin\", or a smaller node spacing";
  return failure(text.str());
}

}  // namespace viscera
