#include "kernels/contact/dense_cholesky.h"

#include <cmath>

#include "kernels/base/wide.h"

namespace viscera {
namespace {

constexpr Eigen::Index kLarge = 128;

/// Column after column, four earlier ones taken off at a time.
VISCERA_WIDE bool factor_columns(double* a, Eigen::Index n) {
  for (Eigen::Index j = 0; j < n; ++j) {
    double* __restrict column = a + j * n;
    Eigen::Index k = 0;
    for (; k + 4 <= j; k += 4) {
      const double *p = a + k * n, *q = p + n, *r = q + n, *s = r + n;
      const double fp = p[j], fq = q[j], fr = r[j], fs = s[j];
#pragma GCC ivdep
      for (Eigen::Index i = j; i < n; ++i) {
        column[i] -= (p[i] * fp + q[i] * fq) + (r[i] * fr + s[i] * fs);
      }
    }
    for (; k < j; ++k) {
      const double* p = a + k * n;
      const double fp = p[j];
#pragma GCC ivdep
      for (Eigen::Index i = j; i < n; ++i) column[i] -= p[i] * fp;
    }
    if (!(column[j] > 0.0) || !std::isfinite(column[j])) return false;
    column[j] = std::sqrt(column[j]);
    const double inverse = 1.0 / column[j];
    for (Eigen::Index i = j + 1; i < n; ++i) column[i] *= inverse;
  }
  return true;
}

/// Four unknowns at a time: alone, each would wait for the one before.
constexpr Eigen::Index kBlock = 4;

VISCERA_WIDE void solve_columns(const double* a, Eigen::Index n, double* __restrict x) {
  const Eigen::Index whole = n - n % kBlock;
  const auto forward_one = [&](Eigen::Index j, Eigen::Index end) {
    const double* column = a + j * n;
    x[j] /= column[j];
    for (Eigen::Index i = j + 1; i < end; ++i) x[i] -= x[j] * column[i];
  };
  for (Eigen::Index j = 0; j < whole; j += kBlock) {
    for (Eigen::Index i = j; i < j + kBlock; ++i) forward_one(i, j + kBlock);
    const double *p = a + j * n, *q = p + n, *r = q + n, *s = r + n;
    const double fp = x[j], fq = x[j + 1], fr = x[j + 2], fs = x[j + 3];
#pragma GCC ivdep
    for (Eigen::Index i = j + kBlock; i < n; ++i) {
      x[i] -= (p[i] * fp + q[i] * fq) + (r[i] * fr + s[i] * fs);
    }
  }
  for (Eigen::Index j = whole; j < n; ++j) forward_one(j, n);

  const auto backward_one = [&](Eigen::Index j, Eigen::Index end) {
    const double* column = a + j * n;
    for (Eigen::Index i = j + 1; i < end; ++i) x[j] -= column[i] * x[i];
    x[j] /= column[j];
  };
  for (Eigen::Index j = n; j-- > whole;) backward_one(j, n);
  for (Eigen::Index j = whole - kBlock; j >= 0; j -= kBlock) {
    const double *p = a + j * n, *q = p + n, *r = q + n, *s = r + n;
    double sp = 0.0, sq = 0.0, sr = 0.0, ss = 0.0;
    for (Eigen::Index i = j + kBlock; i < n; ++i) {
      sp += p[i] * x[i];
      sq += q[i] * x[i];
      sr += r[i] * x[i];
      ss += s[i] * x[i];
    }
    x[j] -= sp;
    x[j + 1] -= sq;
    x[j + 2] -= sr;
    x[j + 3] -= ss;
    for (Eigen::Index i = j + kBlock; i-- > j;) backward_one(i, j + kBlock);
  }
}

}  // namespace

bool DenseCholesky::compute(const MatrixX& matrix) {
  is_large_ = matrix.rows() > kLarge;
  if (is_large_) {
    large_.compute(matrix);
    // It lets a value that isn't a number pass.
    return large_.info() == Eigen::Success && large_.matrixLLT().diagonal().allFinite();
  }
  lower_ = matrix;
  return factor_columns(lower_.data(), lower_.rows());
}

void DenseCholesky::solve_in_place(VectorX& x) const {
  if (is_large_) {
    large_.solveInPlace(x);
  } else {
    solve_columns(lower_.data(), lower_.rows(), x.data());
  }
}

}  // namespace viscera
