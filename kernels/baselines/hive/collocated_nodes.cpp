#include "kernels/baselines/hive/collocated_nodes.h"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>

#include "kernels/base/wide.h"
#include "kernels/paff/shape_functions.h"

namespace viscera {
namespace {

constexpr double kSupport = 3.0;  // of `paper`: support radius over spacing

/// x -= L x over the first `count` columns of a unit lower triangle, four at a time.
[[gnu::always_inline]] inline void take_off(const double* a, Eigen::Index n, Eigen::Index count,
                                            double* __restrict x) {
  Eigen::Index k = 0;
  for (; k + 4 <= count; k += 4) {
    const double *p = a + k * n, *q = p + n, *r = q + n, *s = r + n;
    const double fp = x[k];
    const double fq = x[k + 1] -= fp * p[k + 1];
    const double fr = x[k + 2] -= fp * p[k + 2] + fq * q[k + 2];
    const double fs = x[k + 3] -= fp * p[k + 3] + fq * q[k + 3] + fr * r[k + 3];
#pragma GCC ivdep
    for (Eigen::Index i = k + 4; i < n; ++i)
      x[i] -= (p[i] * fp + q[i] * fq) + (r[i] * fr + s[i] * fs);
  }
  for (; k < count; ++k) {
    const double* p = a + k * n;
    const double f = x[k];
#pragma GCC ivdep
    for (Eigen::Index i = k + 1; i < n; ++i) x[i] -= p[i] * f;
  }
}

/// L U with row exchanges, in place, column-major, column after column; false: singular.
VISCERA_WIDE bool factor_rows(double* a, Eigen::Index n, int* pivots) {
  for (Eigen::Index j = 0; j < n; ++j) {
    double* column = a + j * n;
    for (Eigen::Index k = 0; k < j; ++k) std::swap(column[k], column[pivots[k]]);
    take_off(a, n, j, column);
    Eigen::Index best = j;
    for (Eigen::Index i = j + 1; i < n; ++i)
      if (std::abs(column[i]) > std::abs(column[best])) best = i;
    pivots[j] = static_cast<int>(best);
    if (!(std::abs(column[best]) > 1e-13) || !std::isfinite(column[best])) return false;
    if (best != j)
      for (Eigen::Index k = 0; k <= j; ++k) std::swap(a[k * n + j], a[k * n + best]);
    const double inverse = 1.0 / column[j];
    for (Eigen::Index i = j + 1; i < n; ++i) column[i] *= inverse;
  }
  return true;
}

VISCERA_WIDE void solve_rows(const double* a, Eigen::Index n, const int* pivots,
                             double* __restrict x) {
  for (Eigen::Index k = 0; k < n; ++k) std::swap(x[k], x[pivots[k]]);
  take_off(a, n, n, x);
  for (Eigen::Index k = n; k-- > 0;) {
    const double* column = a + k * n;
    const double f = x[k] /= column[k];
#pragma GCC ivdep
    for (Eigen::Index i = 0; i < k; ++i) x[i] -= f * column[i];
  }
}

}  // namespace

CollocatedNodes::CollocatedNodes(const HivePattern& pattern)
    : count_(pattern.nodes()),
      matrix_(3 * count_, 3 * count_),
      loads_(3 * count_, 3 * pattern.free_nodes()),
      surface_values_(pattern.free_nodes(), count_) {
  const auto n = static_cast<std::size_t>(count_);
  spacings_.resize(n);
  pivots_.resize(3 * n);
  values_.resize(n);
  gradients_.resize(n);
  hessians_.resize(n);
  basis_.resize(n);
  weights_.resize(n);
  near_.reserve(n);
}

/// The derivation stands in paper_formulation.cpp: c = A^-1 P, c_k = A^-1 (P_k - A_k c),
/// c_kl = A^-1 (-A_kl c - A_k c_l - A_l c_k).
bool CollocatedNodes::evaluate(int node, std::span<const Vec3> positions,
                               bool with_derivatives) noexcept {
  const Vec3& x = positions[static_cast<std::size_t>(node)];
  const double unit = kSupport * spacings_[static_cast<std::size_t>(node)];
  using Mat4 = Eigen::Matrix4d;
  // A, its first derivatives x, y, z and its second xx, yx, yy, zx, zy, zz; of each the ten
  // different products of 1, x, y, z.
  constexpr int kParts = 10, kProducts = 10;
  std::array<std::array<double, kProducts>, kParts> sums{};
  Mat4 plain = Mat4::Zero();
  near_.clear();
  for (int j = 0; j < count_; ++j) {
    const auto at = static_cast<std::size_t>(j);
    const Vec3 d = (positions[at] - x) / unit;
    const double radius = kSupport * spacings_[at] / unit, s = d.norm() / radius;
    if (s >= 1.0) continue;
    near_.push_back(j);
    if (!with_derivatives) {
      weights_[at] = quartic_weight(s);
      basis_[at] = Vec4(1.0, d.x(), d.y(), d.z());
      const Mat4 outer = basis_[at] * basis_[at].transpose();
      plain += weights_[at] * outer;
      continue;
    }
    const double rest = 1.0 - s, by_s = -12.0 * rest * rest,
                 curvature = -12.0 * rest * (1.0 - 3.0 * s), r2 = radius * radius;
    weights_[at] = quartic_weight(s);
    basis_[at] = Vec4(1.0, d.x(), d.y(), d.z());
    const Vec3 direction = s > 0.0 ? Vec3(d / d.norm()) : Vec3(Vec3::Zero());
    gradients_[at] = -by_s / r2 * d;
    hessians_[at] =
        (by_s * Mat3::Identity() + (curvature - by_s) * direction * direction.transpose()) / r2;
    const Vec3& g = gradients_[at];
    const Mat3& h = hessians_[at];
    const double factors[kParts] = {weights_[at], g.x(),   g.y(),   g.z(),   h(0, 0),
                                    h(1, 0),      h(1, 1), h(2, 0), h(2, 1), h(2, 2)};
    const double products[kProducts] = {1.0,           d.x(),         d.y(),         d.z(),
                                        d.x() * d.x(), d.x() * d.y(), d.x() * d.z(), d.y() * d.y(),
                                        d.y() * d.z(), d.z() * d.z()};
    for (std::size_t part = 0; part < kParts; ++part)
      for (std::size_t p = 0; p < kProducts; ++p) sums[part][p] += factors[part] * products[p];
  }
  const auto matrix_of = [&](std::size_t part) {
    const auto& p = sums[part];
    Mat4 out;
    out << p[0], p[1], p[2], p[3], p[1], p[4], p[5], p[6], p[2], p[5], p[7], p[8], p[3], p[6], p[8],
        p[9];
    return out;
  };
  const Mat4 moments = with_derivatives ? matrix_of(0) : plain;
  const std::array<Mat4, 3> first = {matrix_of(1), matrix_of(2), matrix_of(3)};
  std::array<std::array<Mat4, 3>, 3> second;
  for (std::size_t k = 0, part = 4; k < 3; ++k)
    for (std::size_t l = 0; l <= k; ++l) second[k][l] = matrix_of(part++);
  if (near_.size() < 4 || !(std::abs(moments.determinant()) > 1e-14)) return false;
  const Mat4 inverse = moments.inverse();
  const Vec4 c = inverse.col(0);
  if (!with_derivatives) {
    for (const int j : near_) {
      const auto at = static_cast<std::size_t>(j);
      values_[at] = weights_[at] * basis_[at].dot(c);
    }
    return true;
  }
  std::array<Vec4, 3> ck;
  std::array<std::array<Vec4, 3>, 3> ckl;
  for (std::size_t k = 0; k < 3; ++k) {
    Vec4 right = -first[k] * c;
    right[static_cast<Eigen::Index>(k) + 1] += 1.0;
    ck[k] = inverse * right;
  }
  for (std::size_t k = 0; k < 3; ++k)
    for (std::size_t l = 0; l <= k; ++l)
      ckl[k][l] = inverse * (-second[k][l] * c - first[k] * ck[l] - first[l] * ck[k]);
  for (const int j : near_) {
    const auto at = static_cast<std::size_t>(j);
    const Vec3 slope = gradients_[at];
    const Mat3 bend = hessians_[at];
    const double weight = weights_[at];
    values_[at] = weight * basis_[at].dot(c);
    for (std::size_t k = 0; k < 3; ++k) {
      const auto row = static_cast<Eigen::Index>(k);
      gradients_[at][row] = basis_[at].dot(slope[row] * c + weight * ck[k]) / unit;
      for (std::size_t l = 0; l <= k; ++l) {
        const auto column = static_cast<Eigen::Index>(l);
        hessians_[at](row, column) = hessians_[at](column, row) =
            basis_[at].dot(bend(row, column) * c + slope[row] * ck[l] + slope[column] * ck[k] +
                           weight * ckl[k][l]) /
            (unit * unit);
      }
    }
  }
  return true;
}

bool CollocatedNodes::condense(const HivePattern& pattern, const HiveNodes& nodes,
                               const IsotropicMaterial& material, const InteriorField* outside,
                               Eigen::Ref<MatrixX> compliance) noexcept {
  const std::span<const Vec3> positions = nodes.positions;
  const int m = pattern.ring_nodes(), free = pattern.free_nodes(), lowest = pattern.layers() - 1;
  for (int i = 0; i < count_; ++i) {
    std::array<double, 7> nearest;  // the node itself first
    nearest.fill(std::numeric_limits<double>::infinity());
    for (int j = 0; j < count_; ++j) {
      double d2 = (positions[static_cast<std::size_t>(i)] - positions[static_cast<std::size_t>(j)])
                      .squaredNorm();
      for (double& held : nearest)
        if (d2 < held) std::swap(d2, held);
    }
    double sum = 0.0;
    for (std::size_t k = 1; k < 7; ++k) sum += std::sqrt(nearest[k]);
    spacings_[static_cast<std::size_t>(i)] = sum / 6.0;
  }
  const double mu = material.shear_modulus(), lambda = material.lame_lambda();
  const double stiff = lambda + 2.0 * mu;
  matrix_.setZero();
  loads_.setZero();
  surface_values_.setZero();
  auto values_on_surface = compliance.topLeftCorner(3 * free, 3 * free);
  for (int i = 0; i < count_; ++i) {
    const double h = spacings_[static_cast<std::size_t>(i)];
    const int place = i % m, layer = i / m;
    const bool is_periphery = place >= free || layer == lowest;
    if (!evaluate(i, positions, !is_periphery)) return false;
    const Vec3 normal = nodes.normals[static_cast<std::size_t>(place)];
    for (const int j : near_) {
      const auto at = static_cast<std::size_t>(j);
      if (i < free) surface_values_(i, j) = values_[at];
      Mat3 part;
      if (is_periphery) {
        part = values_[at] * Mat3::Identity();
      } else if (layer == 0) {
        const Vec3& g = gradients_[at];
        part = (h / stiff) * (lambda * normal * g.transpose() + mu * g * normal.transpose());
        part.diagonal().array() += (h / stiff) * mu * g.dot(normal);
      } else {
        part = (h * h / stiff) * (lambda + mu) * hessians_[at];
        part.diagonal().array() += (h * h / stiff) * mu * hessians_[at].trace();
      }
      matrix_.block<3, 3>(3 * i, 3 * j) = part;
    }
    if (!is_periphery && layer == 0) {
      const double load = h / (stiff * nodes.areas[static_cast<std::size_t>(place)]);
      for (int c = 0; c < 3; ++c) loads_(3 * i + c, 3 * i + c) = load;
    }
    if (is_periphery && outside) {
      for (int j = 0; j < free; ++j)
        loads_.block<3, 3>(3 * i, 3 * j) = outside->displacement(
            positions[static_cast<std::size_t>(i)] - positions[static_cast<std::size_t>(j)],
            -nodes.normals[static_cast<std::size_t>(j)]);
    }
  }
  if (!factor()) return false;
  for (Eigen::Index j = 0; j < loads_.cols(); ++j) solve(loads_.col(j).data());
  values_on_surface.setZero();
  for (int i = 0; i < free; ++i)
    for (int j = 0; j < count_; ++j)
      values_on_surface.middleRows<3>(3 * i) += surface_values_(i, j) * loads_.middleRows<3>(3 * j);
  return values_on_surface.allFinite();
}

bool CollocatedNodes::factor() noexcept {
  return factor_rows(matrix_.data(), matrix_.rows(), pivots_.data());
}

void CollocatedNodes::solve(double* x) const noexcept {
  solve_rows(matrix_.data(), matrix_.rows(), pivots_.data(), x);
}

}  // namespace viscera
