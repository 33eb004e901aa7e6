#include "kernels/paff/compliance_checks.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>
#include <vector>

#include "kernels/base/parallel.h"
#include "kernels/base/random.h"
#include "kernels/paff/blas.h"
#include "kernels/paff/tiled_cholesky.h"

namespace viscera {
namespace {

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

  double frobenius_norm() const {
    double sum = 0.0;
    for (std::size_t j = 0; j < order(); ++j) {
      for (std::size_t i = 0; i < order(); ++i) sum += (*this)(i, j) * (*this)(i, j);
    }
    return std::sqrt(sum);
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

/// The largest eigenvalue in size, by iteration, from below.
double largest_eigenvalue(const SymmetricPart& matrix) {
  constexpr int kSteps = 12;
  std::vector<double> x = start<double>(matrix.order()), y(x.size());
  double value = 0.0;
  for (int step = 0; step < kSteps; ++step) {
    matrix.multiply(x, y);
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

bool is_positive(const SymmetricPart& matrix, double shift) {
  const std::size_t n = matrix.order();
  std::vector<double> factor(n * n);
  parallel_for_each_index(n, 16, [&](std::size_t j) {
    for (std::size_t i = j; i < n; ++i) factor[j * n + i] = matrix(i, j) + (i == j ? shift : 0.0);
  });
  return eliminate<double>(n, n, factor.data(), nullptr);
}

/// What round-off alone may take from the smallest eigenvalue. Symmetric compliances come from a
/// factor in single precision, 1e-6 of the largest. Unsymmetric ones are solved for in double and
/// then stored: each entry, and each mean of two, is off by 2^-24 of itself, which in 2-norm is at
/// most 2^-23 of the Frobenius norm.
double round_off(const SymmetricPart& matrix, bool symmetric, double largest) {
  return symmetric ? 1e-6 * largest : 0x1.0p-23 * matrix.frobenius_norm();
}

/// The smallest eigenvalue of a matrix that isn't positive: -s for the least shift s that makes it
/// so, to 3 %, from below. Whether a factorisation succeeds is certain, where an iteration towards
/// an eigenvalue among many of its size may stop short of it. 0 where a shift of `low` does.
double negative_eigenvalue(const SymmetricPart& matrix, double size, double low) {
  if (is_positive(matrix, low)) return 0.0;
  double high = 10.0 * low;
  while (high < 100.0 * size && !is_positive(matrix, high)) {
    low = high;
    high *= 10.0;
  }
  for (int step = 0; step < 6; ++step) {
    const double middle = std::sqrt(low * high);
    (is_positive(matrix, middle) ? high : low) = middle;
  }
  return -high;
}

}  // namespace

double smallest_compliance_eigenvalue(const SurfaceCompliance& compliance) {
  prepare_blas();
  const SymmetricPart matrix(compliance);
  if (matrix.order() == 0) return 1.0;
  // The largest in size may be a negative one.
  const double size = largest_eigenvalue(matrix);
  if (!std::isfinite(size)) return std::numeric_limits<double>::quiet_NaN();
  if (!(size > 0.0)) return -1.0;
  double smallest = 0.0;
  if (matrix.order() > kDoubleBelow) smallest = by_inverse_iteration<float>(matrix, size);
  if (!(smallest > 0.0)) smallest = by_inverse_iteration<double>(matrix, size);
  if (smallest > 0.0) return std::min(1.0, smallest / size);
  return negative_eigenvalue(matrix, size, round_off(matrix, compliance.symmetric, size)) / size;
}

Result<void> expect_positive_compliance(double smallest_eigenvalue) {
  if (smallest_eigenvalue >= 0.0) return {};
  std::ostringstream text;
  text << "compliance: its smallest eigenvalue is " << smallest_eigenvalue
       << " of its largest; expected a positive one, since tissue would feed energy into the tool "
          "otherwise: use formulation \"galerkin\", or a smaller node spacing";
  return failure(text.str());
}

Result<std::string> accept_compliance(const Formulation& formulation, double smallest_eigenvalue) {
  const Result<void> positive = expect_positive_compliance(smallest_eigenvalue);
  if (positive) return std::string();
  if (formulation.warning().empty() || std::isnan(smallest_eigenvalue))
    return std::unexpected(positive.error());
  std::ostringstream text;
  text << "the smallest eigenvalue of its compliance is " << smallest_eigenvalue
       << " of the largest: such tissue may give energy away to a tool, and contact with it may "
          "find no forces (a flag of the run); never to be felt by a haptic hand";
  return text.str();
}

}  // namespace viscera
