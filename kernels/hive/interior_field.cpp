#include "kernels/hive/interior_field.h"

#include <numbers>

namespace viscera {

// With z the depth, t the part along the surface, R = |x|, q = 1 / (R + z), s = q / R, k = 1 - 2 nu
// and I_t the identity in the surface:
//   4 pi G U = I/R + x x^T/R^3 + k [ n n^T/R - s t n^T + q I_t - s q t t^T + s n t^T ],
// n inward; columns are Boussinesq's and Cerruti's solutions.

InteriorField::InteriorField(const IsotropicMaterial& material)
    : scale_(1.0 / (4.0 * std::numbers::pi * material.shear_modulus())),
      kappa_(1.0 - 2.0 * material.poisson_ratio),
      lambda_(material.lame_lambda()),
      mu_(material.shear_modulus()) {}

Mat3 InteriorField::displacement(const Vec3& x, const Vec3& n) const {
  const double r = x.norm(), z = n.dot(x), inverse = 1.0 / r;
  const double q = 1.0 / (r + z), s = q * inverse;
  const Vec3 t = x - z * n;
  const Mat3 nn = n * n.transpose(), tn = t * n.transpose();
  return scale_ * (inverse * Mat3::Identity() + inverse * inverse * inverse * x * x.transpose() +
                   kappa_ * (inverse * nn + q * (Mat3::Identity() - nn) -
                             s * q * t * t.transpose() + s * (tn.transpose() - tn)));
}

std::array<Mat3, 3> InteriorField::gradient(const Vec3& x, const Vec3& n) const {
  const double r = x.norm(), z = n.dot(x), inverse = 1.0 / r, inverse2 = inverse * inverse;
  const double q = 1.0 / (r + z), s = q * inverse;
  const Vec3 t = x - z * n;
  const Mat3 nn = n * n.transpose(), across = Mat3::Identity() - nn;
  const Mat3 xx = x * x.transpose(), tt = t * t.transpose(), tn = t * n.transpose();
  std::array<Mat3, 3> out;
  for (int d = 0; d < 3; ++d) {
    const Vec3 step = Vec3::Unit(d), along = across.col(d);
    const double dr = x[d] * inverse;
    const double dq = -q * q * (dr + n[d]);
    const double ds = dq * inverse - q * dr * inverse2;
    const Mat3 dx = step * x.transpose(), dt = along * t.transpose(), dn = along * n.transpose();
    out[static_cast<std::size_t>(d)] =
        scale_ * (-dr * inverse2 * Mat3::Identity() + inverse2 * inverse * (dx + dx.transpose()) -
                  3.0 * dr * inverse2 * inverse2 * xx +
                  kappa_ * (-dr * inverse2 * nn + dq * across - s * q * (dt + dt.transpose()) -
                            (ds * q + s * dq) * tt + s * (dn.transpose() - dn) +
                            ds * (tn.transpose() - tn)));
  }
  return out;
}

Mat3 InteriorField::traction(const Vec3& x, const Vec3& inward, const Vec3& normal) const {
  const std::array<Mat3, 3> by = gradient(x, inward);
  Mat3 out;
  for (int f = 0; f < 3; ++f) {
    Mat3 slope;  // d u_i / d x_j
    for (int j = 0; j < 3; ++j) slope.col(j) = by[static_cast<std::size_t>(j)].col(f);
    out.col(f) = lambda_ * slope.trace() * normal + mu_ * (slope + slope.transpose()) * normal;
  }
  return out;
}

}  // namespace viscera
