// The 4 x 4 moment matrix of moving least squares with linear basis, and its Cholesky factor.
#pragma once

#include <array>
#include <cmath>

#include "kernels/base/types.h"

namespace viscera {

/// M = sum_J W_J p_J p_J^T, p_J = (1, d_J), d_J the offset of node J from the evaluation point in
/// units of a length scale. Lower triangle, row by row. [De2006] eq. 4.
class MomentMatrix {
 public:
  void add(double weight, const Vec3& d) {
    const double wx = weight * d.x(), wy = weight * d.y(), wz = weight * d.z();
    a_[0] += weight;
    a_[1] += wx;
    a_[2] += wx * d.x();
    a_[3] += wy;
    a_[4] += wy * d.x();
    a_[5] += wy * d.y();
    a_[6] += wz;
    a_[7] += wz * d.x();
    a_[8] += wz * d.y();
    a_[9] += wz * d.z();
  }

  /// M = L L^T in place. False when M is singular: fewer than four nodes, or nodes in a plane.
  bool factor() {
    // Nodes that leave a plane by a thousandth of the support give pivots of 1e-6 of M_00.
    const double smallest = 1e-10 * a_[0];
    for (int i = 0; i < 4; ++i) {
      for (int j = 0; j <= i; ++j) {
        double sum = at(i, j);
        for (int k = 0; k < j; ++k) sum -= at(i, k) * at(j, k);
        if (i != j) {
          at(i, j) = sum / at(j, j);
        } else if (sum > smallest) {
          at(i, i) = std::sqrt(sum);
        } else {
          return false;
        }
      }
    }
    return true;
  }

  /// L^-1 b, after factor().
  Vec4 forward(Vec4 b) const {
    for (int i = 0; i < 4; ++i) {
      for (int j = 0; j < i; ++j) b[i] -= at(i, j) * b[j];
      b[i] /= at(i, i);
    }
    return b;
  }

  /// M^-1 b, after factor().
  Vec4 solve(const Vec4& b) const {
    Vec4 y = forward(b);
    for (int i = 3; i >= 0; --i) {
      for (int j = i + 1; j < 4; ++j) y[i] -= at(j, i) * y[j];
      y[i] /= at(i, i);
    }
    return y;
  }

 private:
  double& at(int i, int j) { return a_[static_cast<std::size_t>(i * (i + 1) / 2 + j)]; }
  double at(int i, int j) const { return a_[static_cast<std::size_t>(i * (i + 1) / 2 + j)]; }

  std::array<double, 10> a_{};
};

}  // namespace viscera
