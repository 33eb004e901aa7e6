// The polynomial bases of moving least squares, their moment matrix and its Cholesky factor.
#pragma once

#include <array>
#include <cmath>

#include "kernels/base/types.h"

namespace viscera {

constexpr int kLinearTerms = 4, kQuadraticTerms = 10;

template <int kTerms>
using BasisVector = Eigen::Matrix<double, kTerms, 1>;

/// p(d) = (1, d), or (1, d, all products of two components of d).
template <int kTerms>
BasisVector<kTerms> basis_at(const Vec3& d) {
  static_assert(kTerms == kLinearTerms || kTerms == kQuadraticTerms);
  BasisVector<kTerms> p;
  p[0] = 1.0;
  p.template segment<3>(1) = d;
  if constexpr (kTerms == kQuadraticTerms) {
    p.template segment<3>(4) = d.x() * d;
    p[7] = d.y() * d.y();
    p[8] = d.y() * d.z();
    p[9] = d.z() * d.z();
  }
  return p;
}

/// M = sum_J W_J p_J p_J^T, p_J the basis at the offset of node J from the evaluation point in
/// units of a length scale. Lower triangle. [De2006] eq. 4.
template <int kTerms>
class MomentMatrix {
 public:
  using Vector = BasisVector<kTerms>;

  void add(double weight, const Vector& p) {
    for (int j = 0; j < kTerms; ++j) {
      const double share = weight * p[j];
      for (int i = j; i < kTerms; ++i) lower_(i, j) += share * p[i];
    }
  }

  /// M = L L^T in place. False when M is singular: fewer nodes than terms, or nodes on a surface
  /// where a polynomial of the basis vanishes (a plane).
  bool factor() {
    // Nodes that leave a plane by a thousandth of the support give pivots of 1e-6 of M_00.
    const double smallest = 1e-10 * lower_(0, 0);
    for (int j = 0; j < kTerms; ++j) {
      if (!(lower_(j, j) > smallest)) return false;
      const double pivot = std::sqrt(lower_(j, j));
      inverse_pivot_[j] = 1.0 / pivot;
      for (int i = j; i < kTerms; ++i) lower_(i, j) *= inverse_pivot_[j];
      for (int k = j + 1; k < kTerms; ++k) {
        const double share = lower_(k, j);
        for (int i = k; i < kTerms; ++i) lower_(i, k) -= share * lower_(i, j);
      }
    }
    return true;
  }

  /// After factor(): solutions lose more than three digits to round-off, and deserve a second pass
  /// with their own residual. 1e-3 of M_00, which is the sum of the weights.
  bool loses_digits() const { return inverse_pivot_.maxCoeff() > 32.0 * inverse_pivot_[0]; }

  /// L^-1 b, after factor().
  Vector forward(Vector b) const {
    for (int j = 0; j < kTerms; ++j) {
      b[j] *= inverse_pivot_[j];
      for (int i = j + 1; i < kTerms; ++i) b[i] -= lower_(i, j) * b[j];
    }
    return b;
  }

  /// M^-1 b, after factor().
  Vector solve(const Vector& b) const {
    Vector y = forward(b);
    for (int i = kTerms - 1; i >= 0; --i) {
      for (int j = i + 1; j < kTerms; ++j) y[i] -= lower_(j, i) * y[j];
      y[i] *= inverse_pivot_[i];
    }
    return y;
  }

 private:
  Eigen::Matrix<double, kTerms, kTerms> lower_ = Eigen::Matrix<double, kTerms, kTerms>::Zero();
  Vector inverse_pivot_ = Vector::Zero();
};

}  // namespace viscera
