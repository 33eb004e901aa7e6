// Elastic laws of tissue by their energy density W(F) [Pa], F the deformation gradient:
//   linear       W = mu e:e + lambda/2 (tr e)^2,  e = (F + F^T)/2 - 1: of small strain
//   stvk         the same of E = (F^T F - 1)/2: St Venant-Kirchhoff, geometrically non-linear;
//   softens
//                when pressed together, and has no answer beyond about 40 % of that
//   neo_hookean  W = mu/2 (F:F - 3) - mu s(J) + lambda/2 s(J)^2,  J = det F, s = log J
//                [BonetWood2008] eq. 6.27
// All are the isotropic linear law for small strain. Below J = 0.1 log goes on as its parabola
// there, so that a guess turned inside out has a finite energy and is pushed back.
//
// Each W is a part at the point and a part that asks for one number alone, its dilatation theta
// (tr e, tr E, J): W = shear(F) + volume(theta). Elements take the mean of theta, so that nearly
// incompressible tissue doesn't lock.
#pragma once

#include <cmath>

#include "kernels/base/types.h"
#include "kernels/hive/hyperelastic_model.h"
#include "kernels/paff/elasticity.h"

namespace viscera {

/// log J, its parabola below `kFrom`; value, slope, curvature.
struct SafeLog {
  static constexpr double kFrom = 0.1;
  double value, slope, curvature;

  explicit SafeLog(double j) {
    const double at = j > kFrom ? j : kFrom, beyond = j - at;
    slope = 1.0 / at;
    curvature = -slope * slope;
    value = std::log(at) + beyond * (slope + 0.5 * beyond * curvature);
    slope += beyond * curvature;
  }
};

/// A law at one deformation gradient. Entries of tangents are derivatives of P_ij by F_kl.
class HyperelasticPoint {
 public:
  HyperelasticPoint(HyperelasticModel model, double mu, const Mat3& f)
      : model_(model), mu_(mu), f_(f) {
    switch (model) {
      case HyperelasticModel::kLinear:
        strain_ = 0.5 * (f + f.transpose()) - Mat3::Identity();
        theta_ = strain_.trace();
        theta_slope_ = Mat3::Identity();
        energy_ = mu * strain_.squaredNorm();
        stress_ = 2.0 * mu * strain_;
        break;
      case HyperelasticModel::kStvk:
        strain_ = 0.5 * (f.transpose() * f - Mat3::Identity());
        left_ = f * f.transpose();
        theta_ = strain_.trace();
        theta_slope_ = f;
        energy_ = mu * strain_.squaredNorm();
        stress_ = 2.0 * mu * f * strain_;
        break;
      case HyperelasticModel::kNeoHookean:
        theta_slope_ << f.col(1).cross(f.col(2)), f.col(2).cross(f.col(0)),
            f.col(0).cross(f.col(1));
        theta_ = f.col(0).dot(theta_slope_.col(0));
        log_ = SafeLog(theta_);
        energy_ = mu * (0.5 * (f.squaredNorm() - 3.0) - log_.value);
        stress_ = mu * (f - log_.slope * theta_slope_);
        break;
    }
  }

  double theta() const { return theta_; }
  const Mat3& theta_slope() const { return theta_slope_; }  ///< by F
  double shear_energy() const { return energy_; }           ///< [Pa]
  const Mat3& shear_stress() const { return stress_; }      ///< first Piola [Pa]

  double theta_curvature(int i, int j, int k, int l) const {
    if (model_ == HyperelasticModel::kStvk) return i == k && j == l ? 1.0 : 0.0;
    if (model_ == HyperelasticModel::kLinear || i == k || j == l) return 0.0;
    // Of the determinant: two indices each way leave one entry of F.
    const bool even = ((k - i + 3) % 3 == 1) == ((l - j + 3) % 3 == 1);
    return even ? f_(3 - i - k, 3 - j - l) : -f_(3 - i - k, 3 - j - l);
  }

  double shear_tangent(int i, int j, int k, int l) const {
    switch (model_) {
      case HyperelasticModel::kLinear:
        return mu_ * ((i == k && j == l ? 1.0 : 0.0) + (i == l && j == k ? 1.0 : 0.0));
      case HyperelasticModel::kStvk:
        return mu_ * ((i == k ? 2.0 * strain_(j, l) : 0.0) + f_(i, l) * f_(k, j) +
                      (j == l ? left_(i, k) : 0.0));
      case HyperelasticModel::kNeoHookean:
        return mu_ * ((i == k && j == l ? 1.0 : 0.0) -
                      log_.curvature * theta_slope_(i, j) * theta_slope_(k, l) -
                      log_.slope * theta_curvature(i, j, k, l));
    }
    return 0.0;
  }

 private:
  HyperelasticModel model_;
  double mu_;
  Mat3 f_, strain_, left_, theta_slope_, stress_;
  double theta_ = 0.0, energy_ = 0.0;
  SafeLog log_{1.0};
};

/// volume(theta) [Pa] with slope and curvature.
struct VolumeEnergy {
  double value, slope, curvature;

  VolumeEnergy(HyperelasticModel model, double lambda, double theta) {
    if (model == HyperelasticModel::kNeoHookean) {
      const SafeLog s(theta);
      value = 0.5 * lambda * s.value * s.value;
      slope = lambda * s.value * s.slope;
      curvature = lambda * (s.slope * s.slope + s.value * s.curvature);
    } else {
      value = 0.5 * lambda * theta * theta;
      slope = lambda * theta;
      curvature = lambda;
    }
  }
};

/// dP/dF, entries of P and F column after column.
using HyperelasticTangent = Eigen::Matrix<double, 9, 9>;

/// Both parts together, at a point.
struct HyperelasticLaw {
  HyperelasticModel model = HyperelasticModel::kLinear;
  double lambda = 0.0, mu = 0.0;  ///< Lame's [Pa]

  HyperelasticLaw(HyperelasticModel which, const IsotropicMaterial& material)
      : model(which), lambda(material.lame_lambda()), mu(material.shear_modulus()) {}

  double energy(const Mat3& f) const {
    const HyperelasticPoint at(model, mu, f);
    return at.shear_energy() + VolumeEnergy(model, lambda, at.theta()).value;
  }
  Mat3 stress(const Mat3& f) const {
    const HyperelasticPoint at(model, mu, f);
    return at.shear_stress() + VolumeEnergy(model, lambda, at.theta()).slope * at.theta_slope();
  }
  HyperelasticTangent tangent(const Mat3& f) const {
    const HyperelasticPoint at(model, mu, f);
    const VolumeEnergy volume(model, lambda, at.theta());
    HyperelasticTangent out;
    for (int row = 0; row < 9; ++row)
      for (int column = 0; column < 9; ++column) {
        const int i = row % 3, j = row / 3, k = column % 3, l = column / 3;
        out(row, column) = at.shear_tangent(i, j, k, l) +
                           volume.curvature * at.theta_slope()(i, j) * at.theta_slope()(k, l) +
                           volume.slope * at.theta_curvature(i, j, k, l);
      }
    return out;
  }
};

}  // namespace viscera
