#include "kernels/paff/shape_functions.h"

#include <cmath>

#include "kernels/paff/moment_matrix.h"

namespace viscera {
namespace {

std::vector<double> support_radii(const PointCloud& cloud, double support_factor) {
  std::vector<double> radii(cloud.spacings);
  for (double& radius : radii) radius *= support_factor;
  return radii;
}

}  // namespace

double quartic_weight(double s) {
  if (s >= 1.0) return 0.0;
  return 1.0 + s * s * (-6.0 + s * (8.0 - 3.0 * s));
}

double quartic_weight_derivative(double s) {
  if (s >= 1.0) return 0.0;
  return -12.0 * s * (1.0 - s) * (1.0 - s);
}

ShapeFunctions::ShapeFunctions(const PointCloud& cloud, double support_factor, Basis basis)
    : cloud_(cloud),
      basis_(basis),
      radii_(support_radii(cloud, support_factor)),
      grid_(cloud_.positions, radii_) {}

bool ShapeFunctions::evaluate(const Vec3& x, bool with_gradients, ShapeValues& out) const {
  return basis_ == Basis::kLinear ? evaluate_with<kLinearTerms>(x, with_gradients, out)
                                  : evaluate_with<kQuadraticTerms>(x, with_gradients, out);
}

template <int kTerms>
bool ShapeFunctions::evaluate_with(const Vec3& x, bool with_gradients, ShapeValues& out) const {
  grid_.reaching(x, out.nodes);
  const std::size_t count = out.nodes.size();
  out.values.resize(count);
  out.weights.resize(count);
  out.gradients.resize(with_gradients ? count : 0);
  if (count < static_cast<std::size_t>(kTerms)) return false;

  const double scale = support_radius(out.nodes[0]);
  const auto offset = [&](std::size_t j) -> Vec3 {
    return (cloud_.positions[static_cast<std::size_t>(out.nodes[j])] - x) / scale;
  };

  MomentMatrix<kTerms> moments;
  for (std::size_t j = 0; j < count; ++j) {
    const Vec3 d = offset(j);
    out.weights[j] = quartic_weight(d.norm() * scale / support_radius(out.nodes[j]));
    moments.add(out.weights[j], basis_at<kTerms>(d));
  }
  if (!moments.factor()) return false;

  // phi_J = W_J p_J . c with c = M^-1 p(x); the basis is shifted to x, so p(x) = (1, 0, 0, ...).
  using Vector = BasisVector<kTerms>;
  const Vector c = moments.solve(Vector::Unit(0));
  // Where the nodes nearly leave a polynomial undetermined (all but one in a plane), c is off by
  // the condition of M times the rounding error. What the values then miss of the basis is a sum of
  // their own, known to round-off: one correction by M^-1 brings it there.
  const auto restore_values = [&] {
    Vector missing = Vector::Unit(0);
    for (std::size_t j = 0; j < count; ++j) missing -= out.values[j] * basis_at<kTerms>(offset(j));
    const Vector correction = moments.solve(missing);
    for (std::size_t j = 0; j < count; ++j)
      out.values[j] += out.weights[j] * correction.dot(basis_at<kTerms>(offset(j)));
  };
  if (!with_gradients) {
    for (std::size_t j = 0; j < count; ++j) {
      out.values[j] = out.weights[j] * c.dot(basis_at<kTerms>(offset(j)));
    }
    if (moments.loses_digits()) restore_values();
    return true;
  }

  // d phi_J / dx_k = dW_J/dx_k p_J . c + W_J p_J . d_k, with d_k = M^-1 (dp/dx_k - dM/dx_k c).
  Eigen::Matrix<double, kTerms, 3> moment_change = Eigen::Matrix<double, kTerms, 3>::Zero();
  for (std::size_t j = 0; j < count; ++j) {
    const Vec3 d = offset(j);
    const Vector p = basis_at<kTerms>(d);
    const double radius = support_radius(out.nodes[j]);
    const double rest = 1.0 - d.norm() * scale / radius;
    // dW/dx = W'(s)/s (x - x_J) / r^2, with W'(s)/s = -12 (1 - s)^2: no division by zero at a node.
    const Vec3 weight_gradient = (12.0 * rest * rest * scale / (radius * radius)) * d;
    const double fitted = c.dot(p);
    out.values[j] = out.weights[j] * fitted;
    out.gradients[j] = fitted * weight_gradient;
    moment_change += p * out.gradients[j].transpose();
  }
  Eigen::Matrix<double, kTerms, 3> coefficients;
  for (int k = 0; k < 3; ++k) {
    Vector right = -moment_change.col(k);
    right[k + 1] += 1.0 / scale;  // all other terms have no slope where the basis is centred
    coefficients.col(k) = moments.solve(right);
  }
  for (std::size_t j = 0; j < count; ++j) {
    out.gradients[j] += out.weights[j] * (coefficients.transpose() * basis_at<kTerms>(offset(j)));
  }
  if (!moments.loses_digits()) return true;
  restore_values();
  Eigen::Matrix<double, kTerms, 3> missing = Eigen::Matrix<double, kTerms, 3>::Zero();
  for (int k = 0; k < 3; ++k) missing(k + 1, k) = 1.0 / scale;
  for (std::size_t j = 0; j < count; ++j)
    missing -= basis_at<kTerms>(offset(j)) * out.gradients[j].transpose();
  for (int k = 0; k < 3; ++k) coefficients.col(k) = moments.solve(missing.col(k));
  for (std::size_t j = 0; j < count; ++j)
    out.gradients[j] += out.weights[j] * (coefficients.transpose() * basis_at<kTerms>(offset(j)));
  return true;
}

}  // namespace viscera
