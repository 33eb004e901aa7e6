// How hard tissue is pulled at a point of a body at finite strain: by the law of finite_body.h,
// of what has had all the time to relax, without its fibres.
//
// With l the greatest stretch and D the change of volume that a cell averages, the greatest
// principal Cauchy stress is
//   sigma_1 = mu (l^2 / J - 1) + (lambda + mu) (J - 1) + averaged D,
// over the point's relative modulus. What is squeezed widens without any: sigma_1 is 0 across a
// column that is free at its sides, however wide it becomes.
#pragma once

#include <Eigen/Eigenvalues>
#include <cmath>

#include "kernels/base/types.h"

namespace viscera {

/// Moduli of the law where the relative modulus is 1 [Pa].
struct LawModuli {
  double shear = 0.0;     ///< mu
  double lambda = 0.0;    ///< that acts point by point
  double averaged = 0.0;  ///< lambda that acts on a cell's average
};

/// Of a point, from where it has no stress.
struct PointDeformation {
  Mat3 gradient = Mat3::Identity();  ///< F
  double dilatation = 0.0;           ///< D; where nothing is averaged 0
};

struct PrincipalStretch {
  double stretch = 1.0;
  Vec3 direction = Vec3::UnitX();  ///< unit, before tissue was deformed; of either sign
};

/// No stretch of F is greater: by the mean square and how far squares are from it, without finding
/// any.
inline double stretch_bound(const Mat3& f) {
  const Mat3 squares = f.transpose() * f;
  const double mean = squares.trace() / 3.0;
  const double beside = (squares - mean * Mat3::Identity()).norm();
  return std::sqrt(mean + std::sqrt(2.0 / 3.0) * beside);
}

inline PrincipalStretch greatest_stretch(const Mat3& f) {
  const Eigen::SelfAdjointEigenSolver<Mat3> squares(f.transpose() * f);
  return {std::sqrt(squares.eigenvalues()[2]), squares.eigenvectors().col(2)};
}

/// Greatest principal Cauchy stress over relative modulus [Pa], where `stretch` is the greatest
/// one. F isn't turned inside out.
inline double greatest_stress(const LawModuli& law, const PointDeformation& point, double stretch) {
  const double volume = point.gradient.determinant();
  return law.shear * (stretch * stretch / volume - 1.0) +
         (law.lambda + law.shear) * (volume - 1.0) + law.averaged * point.dilatation;
}

/// The same of a strip that is pulled so far, free at its sides: these have no stress where
/// J - 1 = mu (1 - 1 / l) / (lambda + averaged + mu).
inline double strip_stress(const LawModuli& law, double stretch) {
  const double volume =
      1.0 + law.shear * (1.0 - 1.0 / stretch) / (law.lambda + law.averaged + law.shear);
  return law.shear * (stretch * stretch / volume - 1.0 / stretch);
}

}  // namespace viscera
