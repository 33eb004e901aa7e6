#include "kernels/finite/warped_factor.h"

#include <Eigen/LU>
#include <Eigen/SVD>
#include <cmath>

namespace viscera {

NodalRotations no_rotations(std::size_t nodes) {
  NodalRotations rotations(9 * nodes, 0.0);
  for (std::size_t node = 0; node < nodes; ++node)
    for (std::size_t k = 0; k < 3; ++k) rotations[9 * node + 4 * k] = 1.0;
  return rotations;
}

Mat3 polar_rotation(const Mat3& f) {
  // Newton's iteration for the polar factor, which squares the error where F isn't turned inside
  // out [Higham1986].
  if (!f.allFinite()) return Mat3::Identity();
  Mat3 r = f;
  for (int step = 0; step < 20; ++step) {
    if (!(r.determinant() > 1e-3)) break;
    const Mat3 next = 0.5 * (r + r.inverse().transpose());
    const double change = (next - r).squaredNorm();
    r = next;
    if (change < 1e-24) return r;
  }
  const Eigen::JacobiSVD<Mat3> svd(f, Eigen::ComputeFullU | Eigen::ComputeFullV);
  if (!(svd.singularValues()[1] > 1e-6)) return Mat3::Identity();
  Mat3 sign = Mat3::Identity();
  sign(2, 2) = (svd.matrixU() * svd.matrixV().transpose()).determinant() > 0.0 ? 1.0 : -1.0;
  return svd.matrixU() * sign * svd.matrixV().transpose();
}

}  // namespace viscera
