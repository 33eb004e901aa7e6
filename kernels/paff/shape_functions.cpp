#include "kernels/paff/shape_functions.h"

#include <algorithm>
#include <cmath>

#include "kernels/paff/moment_matrix.h"
#include "kernels/paff/true_neighbours.h"

namespace viscera {
namespace {

std::vector<double> support_radii(const PointCloud& cloud, double support_factor) {
  std::vector<double> radii(cloud.spacings);
  for (double& radius : radii) radius *= support_factor;
  return radii;
}

}  // namespace

int ShapeValues::strongest() const {
  if (nodes.empty()) return -1;
  const auto most = std::ranges::max_element(values, {}, [](double v) { return std::abs(v); });
  return nodes[static_cast<std::size_t>(most - values.begin())];
}

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

ShapeFunctions::ShapeFunctions(const TriangleSurface& surface, const PointCloud& cloud,
                               double support_factor, Basis basis)
    : ShapeFunctions(TrueNeighbours::find(surface, cloud, support_factor), cloud, support_factor,
                     basis) {}

ShapeFunctions::ShapeFunctions(std::shared_ptr<const TrueNeighbours> neighbours,
                               const PointCloud& cloud, double support_factor, Basis basis)
    : neighbours_(std::move(neighbours)),
      cloud_(neighbours_ ? neighbours_->cloud() : cloud),
      basis_(basis),
      radii_(support_radii(cloud_, support_factor)),
      grid_(cloud.positions, std::span<const double>(radii_).first(cloud.size())) {}

/// What a place has of the nodes that don't see it.
struct ShapeFunctions::Shadows {
  struct One {
    std::size_t entry;  ///< of the ShapeValues
    double weight;      ///< W of the way through tissue
    Vec3 slope;         ///< of it [1/m]
    int twin;           ///< -1: the node has none, and weighs this
  };
  std::vector<One> all;
  const One* of(std::size_t entry) const {
    for (const One& one : all)
      if (one.entry == entry) return &one;
    return nullptr;
  }
};

/// Takes nodes that have nothing of the place off the list.
void ShapeFunctions::find_shadows(const Vec3& x, ShapeValues& out, Shadows& shadows) const {
  shadows.all.clear();
  std::size_t kept = 0;
  thread_local TrueNeighbours::View view;
  view.take(*neighbours_, x);
  for (const int node : out.nodes) {
    TrueNeighbours::Shadow shadow;
    if (neighbours_->shadow(node, view, shadow)) {
      const double radius = support_radius(node), s = shadow.way / radius;
      const double weight = quartic_weight(s);
      if (weight == 0.0 && shadow.twin < 0) continue;
      shadows.all.push_back(
          {kept, weight, quartic_weight_derivative(s) / radius * shadow.gradient, shadow.twin});
    }
    out.nodes[kept++] = node;
  }
  out.nodes.resize(kept);
}

/// phi becomes s phi and (1 - s) phi, s = weight of the way through tissue / W.
void ShapeFunctions::share_with_twins(const Vec3& x, const Shadows& shadows,
                                      ShapeValues& out) const {
  struct Entry {
    int node;
    double value, weight;
    Vec3 gradient;
    bool operator<(const Entry& other) const { return node < other.node; }
  };
  const bool with_gradients = !out.gradients.empty();
  std::vector<Entry> entries;
  for (std::size_t j = 0; j < out.nodes.size(); ++j) {
    const Entry whole{out.nodes[j], out.values[j], out.weights[j],
                      with_gradients ? out.gradients[j] : Vec3(Vec3::Zero())};
    const Shadows::One* shadow = shadows.of(j);
    if (!shadow || shadow->twin < 0) {
      entries.push_back(whole);
      continue;
    }
    // The farthest weights may be nothing in double precision.
    const double share = whole.weight > 0.0 ? std::min(1.0, shadow->weight / whole.weight) : 0.0;
    Vec3 slope = Vec3::Zero();  // phi grad s
    if (with_gradients && share > 0.0) {
      const double radius = support_radius(whole.node);
      const Vec3 offset = cloud_.positions[static_cast<std::size_t>(whole.node)] - x;
      const double rest = 1.0 - offset.norm() / radius;
      const Vec3 weight_slope = (12.0 * rest * rest / (radius * radius)) * offset;
      slope = whole.value / whole.weight * (shadow->slope - share * weight_slope);
    }
    const Entry own{whole.node, share * whole.value, shadow->weight,
                    share * whole.gradient + slope};
    if (share > 0.0) entries.push_back(own);
    if (share < 1.0)
      entries.push_back({shadow->twin, whole.value - own.value, whole.weight - own.weight,
                         whole.gradient - own.gradient});
  }
  std::sort(entries.begin(), entries.end());
  out.nodes.clear();
  out.values.clear();
  out.weights.clear();
  out.gradients.clear();
  for (const Entry& entry : entries) {
    out.nodes.push_back(entry.node);
    out.values.push_back(entry.value);
    out.weights.push_back(entry.weight);
    if (with_gradients) out.gradients.push_back(entry.gradient);
  }
}

bool ShapeFunctions::evaluate(const Vec3& x, bool with_gradients, ShapeValues& out) const {
  return basis_ == Basis::kLinear ? evaluate_with<kLinearTerms>(x, with_gradients, out)
                                  : evaluate_with<kQuadraticTerms>(x, with_gradients, out);
}

template <int kTerms>
bool ShapeFunctions::evaluate_with(const Vec3& x, bool with_gradients, ShapeValues& out) const {
  grid_.reaching(x, out.nodes);
  Shadows shadows;
  if (neighbours_) find_shadows(x, out, shadows);
  const std::size_t count = out.nodes.size();
  out.values.resize(count);
  out.weights.resize(count);
  out.gradients.resize(with_gradients ? count : 0);
  if (count < static_cast<std::size_t>(kTerms)) return false;

  const double scale = support_radius(out.nodes[0]);
  const auto offset = [&](std::size_t j) -> Vec3 {
    return (cloud_.positions[static_cast<std::size_t>(out.nodes[j])] - x) / scale;
  };

  // A node without a twin weighs what its way through tissue leaves; one with a twin is shared at
  // the end.
  const auto untwinned = [&](std::size_t j) -> const Shadows::One* {
    const Shadows::One* one = shadows.all.empty() ? nullptr : shadows.of(j);
    return one && one->twin < 0 ? one : nullptr;
  };
  const auto finished = [&] {
    if (!shadows.all.empty()) share_with_twins(x, shadows, out);
    return true;
  };

  MomentMatrix<kTerms> moments;
  for (std::size_t j = 0; j < count; ++j) {
    const Vec3 d = offset(j);
    out.weights[j] = quartic_weight(d.norm() * scale / support_radius(out.nodes[j]));
    if (const auto* shadow = untwinned(j)) out.weights[j] = shadow->weight;
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
    return finished();
  }

  // d phi_J / dx_k = dW_J/dx_k p_J . c + W_J p_J . d_k, with d_k = M^-1 (dp/dx_k - dM/dx_k c).
  Eigen::Matrix<double, kTerms, 3> moment_change = Eigen::Matrix<double, kTerms, 3>::Zero();
  for (std::size_t j = 0; j < count; ++j) {
    const Vec3 d = offset(j);
    const Vector p = basis_at<kTerms>(d);
    const double radius = support_radius(out.nodes[j]);
    const double rest = 1.0 - d.norm() * scale / radius;
    // dW/dx = W'(s)/s (x - x_J) / r^2, with W'(s)/s = -12 (1 - s)^2: no division by zero at a node.
    Vec3 weight_gradient = (12.0 * rest * rest * scale / (radius * radius)) * d;
    if (const auto* shadow = untwinned(j)) weight_gradient = shadow->slope;
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
  if (!moments.loses_digits()) return finished();
  restore_values();
  Eigen::Matrix<double, kTerms, 3> missing = Eigen::Matrix<double, kTerms, 3>::Zero();
  for (int k = 0; k < 3; ++k) missing(k + 1, k) = 1.0 / scale;
  for (std::size_t j = 0; j < count; ++j)
    missing -= basis_at<kTerms>(offset(j)) * out.gradients[j].transpose();
  for (int k = 0; k < 3; ++k) coefficients.col(k) = moments.solve(missing.col(k));
  for (std::size_t j = 0; j < count; ++j)
    out.gradients[j] += out.weights[j] * (coefficients.transpose() * basis_at<kTerms>(offset(j)));
  return finished();
}

}  // namespace viscera
