#include "kernels/contact/dense_cholesky.h"

#include <cmath>

#include "kernels/base/wide.h"

namespace viscera {
namespace {

constexpr Eigen::Index kLarge = 128;

}  // namespace

VISCERA_WIDE bool partial_cholesky(double* a, Eigen::Index stride, Eigen::Index rows,
                                   Eigen::Index columns, Eigen::Index pivots) {
  for (Eigen::Index j = 0; j < columns; ++j) {
    double* __restrict column = a + j * stride;
    const Eigen::Index earlier = j < pivots ? j : pivots;
    Eigen::Index k = 0;
    for (; k + 4 <= earlier; k += 4) {
      const double *p = a + k * stride, *q = p + stride, *r = q + stride, *s = r + stride;
      const double fp = p[j], fq = q[j], fr = r[j], fs = s[j];
#pragma GCC ivdep
      for (Eigen::Index i = j; i < rows; ++i) {
        column[i] -= (p[i] * fp + q[i] * fq) + (r[i] * fr + s[i] * fs);
      }
    }
    for (; k < earlier; ++k) {
      const double* p = a + k * stride;
      const double fp = p[j];
#pragma GCC ivdep
      for (Eigen::Index i = j; i < rows; ++i) column[i] -= p[i] * fp;
    }
    if (j >= pivots) continue;
    if (!(column[j] > 0.0) || !std::isfinite(column[j])) return false;
    column[j] = std::sqrt(column[j]);
    const double inverse = 1.0 / column[j];
    for (Eigen::Index i = j + 1; i < rows; ++i) column[i] *= inverse;
  }
  return true;
}

namespace {

/// Four unknowns at a time: alone, each would wait for the one before.
constexpr Eigen::Index kBlock = 4;

}  // namespace

VISCERA_WIDE void solve_lower(const double* a, Eigen::Index stride, Eigen::Index n,
                              double* __restrict x) {
  const Eigen::Index whole = n - n % kBlock;
  const auto forward_one = [&](Eigen::Index j, Eigen::Index end) {
    const double* column = a + j * stride;
    x[j] /= column[j];
    for (Eigen::Index i = j + 1; i < end; ++i) x[i] -= x[j] * column[i];
  };
  for (Eigen::Index j = 0; j < whole; j += kBlock) {
    for (Eigen::Index i = j; i < j + kBlock; ++i) forward_one(i, j + kBlock);
    const double *p = a + j * stride, *q = p + stride, *r = q + stride, *s = r + stride;
    const double fp = x[j], fq = x[j + 1], fr = x[j + 2], fs = x[j + 3];
#pragma GCC ivdep
    for (Eigen::Index i = j + kBlock; i < n; ++i) {
      x[i] -= (p[i] * fp + q[i] * fq) + (r[i] * fr + s[i] * fs);
    }
  }
  for (Eigen::Index j = whole; j < n; ++j) forward_one(j, n);
}

VISCERA_WIDE void solve_lower_transposed(const double* a, Eigen::Index stride, Eigen::Index n,
                                         double* __restrict x) {
  const Eigen::Index whole = n - n % kBlock;
  const auto backward_one = [&](Eigen::Index j, Eigen::Index end) {
    const double* column = a + j * stride;
    for (Eigen::Index i = j + 1; i < end; ++i) x[j] -= column[i] * x[i];
    x[j] /= column[j];
  };
  for (Eigen::Index j = n; j-- > whole;) backward_one(j, n);
  for (Eigen::Index j = whole - kBlock; j >= 0; j -= kBlock) {
    const double *p = a + j * stride, *q = p + stride, *r = q + stride, *s = r + stride;
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

bool DenseCholesky::compute(const MatrixX& matrix) {
  is_large_ = matrix.rows() > kLarge;
  if (is_large_) {
    large_.compute(matrix);
    // It lets a value that isn't a number pass.
    return large_.info() == Eigen::Success && large_.matrixLLT().diagonal().allFinite();
  }
  lower_ = matrix;
  const Eigen::Index n = lower_.rows();
  return partial_cholesky(lower_.data(), n, n, n, n);
}

void DenseCholesky::solve_in_place(VectorX& x) const {
  if (is_large_) {
    large_.solveInPlace(x);
  } else {
    solve_lower(lower_.data(), lower_.rows(), lower_.rows(), x.data());
    solve_lower_transposed(lower_.data(), lower_.rows(), lower_.rows(), x.data());
  }
}

}  // namespace viscera
