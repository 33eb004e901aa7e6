#include "kernels/contact/near_field.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace viscera {
namespace {

constexpr double kPi = std::numbers::pi;

/// exp(-x) I0(x), x >= 0, to 3e-7: Abramowitz and Stegun 9.8.1 and 9.8.2. Scaled, so that nothing
/// overflows far from the cell.
double scaled_bessel_i0(double x) {
  if (x < 3.75) {
    const double t = (x / 3.75) * (x / 3.75);
    return std::exp(-x) *
           (1.0 + t * (3.5156229 +
                       t * (3.0899424 +
                            t * (1.2067492 + t * (0.2659732 + t * (0.0360768 + t * 0.0045813))))));
  }
  const double t = 3.75 / x;
  return (0.39894228 +
          t * (0.01328592 +
               t * (0.00225319 +
                    t * (-0.00157565 +
                         t * (0.00916281 +
                              t * (-0.02057706 +
                                   t * (0.02635537 + t * (-0.01647633 + t * 0.00392377)))))))) /
         std::sqrt(x);
}

/// 1 / r spread by a Gaussian of standard deviation s: the mean of 1 / |x - y| over y.
double spread_inverse_distance(double r, double s) {
  const double x = r * r / (4.0 * s * s);
  return std::sqrt(kPi / 2.0) / s * scaled_bessel_i0(x);
}

/// Overlap of two unit discs whose centres are d apart.
double lens_area(double d) {
  if (d >= 2.0) return 0.0;
  return 2.0 * std::acos(0.5 * d) - 0.5 * d * std::sqrt(4.0 - d * d);
}

/// Mean of 1 / |x - y| over two unit discs d apart. x - y is distributed as the overlap of the
/// discs shifted by it, so in polar coordinates about the singularity one smooth integral is left.
double disc_disc_by_quadrature(double d) {
  constexpr int kAngles = 96, kRadii = 96;
  double sum = 0.0;
  for (int i = 0; i < kAngles; ++i) {
    const double cosine = std::cos(kPi * (i + 0.5) / kAngles);
    // Where the ray leaves (and, from outside, enters) the disc of radius 2 that holds the overlap.
    const double root2 = 4.0 - d * d * (1.0 - cosine * cosine);
    if (root2 <= 0.0) continue;
    const double begin = std::max(0.0, -d * cosine - std::sqrt(root2));
    const double end = -d * cosine + std::sqrt(root2);
    if (end <= begin) continue;
    const double step = (end - begin) / kRadii;
    for (int j = 0; j < kRadii; ++j) {
      const double r = begin + (j + 0.5) * step;
      sum += step * lens_area(std::sqrt(std::max(0.0, d * d + r * r + 2.0 * d * r * cosine)));
    }
  }
  return 2.0 * sum * (kPi / kAngles) / (kPi * kPi);
}

/// Discs nearer than this many radii take the table, farther ones the multipole series.
constexpr double kTableEnd = 4.0;
constexpr int kTableSteps = 64;

const std::array<double, kTableSteps + 3>& disc_disc_table() {
  static const auto table = [] {
    std::array<double, kTableSteps + 3> values{};
    for (int i = 0; i < kTableSteps + 3; ++i) {
      values[static_cast<std::size_t>(i)] =
          disc_disc_by_quadrature(std::abs(i - 1) * kTableEnd / kTableSteps);
    }
    values[1] = 16.0 / (3.0 * kPi);  // the cell itself, exactly
    return values;
  }();
  return table;
}

/// Mean of 1 / |x - y| over two discs of radius c whose centres are r apart. The mean over a disc
/// is sum (c^2 lap)^n / (4^n n! (n+1)!), and lap r^-m = m^2 r^-(m+2) in the plane.
double disc_disc(double r, double c) {
  const double d = r / c;
  if (d >= kTableEnd) {
    const double t = 1.0 / (d * d);
    return (1.0 + t * (0.25 + t * (45.0 / 192.0 + t * (1575.0 / 4608.0 + t * 0.628)))) / r;
  }
  // Cubic through four entries of the table.
  const auto& table = disc_disc_table();
  const double place = d * kTableSteps / kTableEnd;
  const auto i = static_cast<std::size_t>(place);
  const double s = place - static_cast<double>(i);
  const double a = table[i], b = table[i + 1], e = table[i + 2];
  const double f = i + 3 < table.size() ? table[i + 3] : 3.0 * (e - b) + a;
  return (b +
          0.5 * s * (e - a + s * (2.0 * a - 5.0 * b + 4.0 * e - f + s * (3.0 * (b - e) + f - a)))) /
         c;
}

/// Mean of 1 / |x - y| over y on a disc of radius c, x in its plane at r: the potential of a
/// uniformly charged disc.
double disc_point(double r, double c) {
  const double d = r / c;
  if (d >= kTableEnd) {
    const double t = 1.0 / (d * d);
    return (1.0 + t * (0.125 + t * (9.0 / 192.0 + t * (225.0 / 9216.0 + t * 0.01495)))) / r;
  }
  if (d <= 1.0) return 4.0 * std::comp_ellint_2(d) / (kPi * c);
  const double k = 1.0 / d;
  return 4.0 * d / (kPi * c) * (std::comp_ellint_2(k) - (1.0 - k * k) * std::comp_ellint_1(k));
}

double disc_radius(double area) {
  return std::sqrt(area / kPi);
}

/// 1, falling smoothly to 0 over the last quarter of the range.
double taper(double r, double range) {
  const double t = std::clamp(4.0 * (1.0 - r / range), 0.0, 1.0);
  return t * t * (3.0 - 2.0 * t);
}

}  // namespace

NearField::NearField(const IsotropicMaterial& material, double sigma)
    : normal_scale_(1.0 / (kPi * material.contact_modulus())),
      tangential_scale_((1.0 + material.poisson_ratio) * (1.0 - 0.5 * material.poisson_ratio) /
                        (kPi * material.youngs_modulus)),
      sigma_(sigma) {}

double NearField::range() const {
  // Far off, the spread kernel exceeds 1/r by sigma^2 / r^3; at r = sigma the two differ by
  // 0.215 / sigma: (1 / (0.215e-3))^(1/3) = 16.7.
  return 16.7 * sigma_;
}

double NearField::drawn_range(double force) const {
  // The tail is sigma^2 / (2 r^3), and that is its size within a third from 3 sigma on.
  constexpr double kInvisible = 1e-6;
  const double scale = std::max(normal_scale_, tangential_scale_);
  const double tail = std::cbrt(force * scale * sigma_ * sigma_ / (2.0 * kInvisible));
  return std::min(range(), std::max(3.0 * sigma_, 1.1 * tail));
}

double NearField::cell_kernel(double r, double area) const {
  if (r >= range()) return 0.0;
  return taper(r, range()) * (disc_disc(r, disc_radius(area)) -
                              spread_inverse_distance(r, std::numbers::sqrt2 * sigma_));
}

double NearField::point_kernel(double r, double area) const {
  if (r >= range()) return 0.0;
  return taper(r, range()) *
         (disc_point(r, disc_radius(area)) - spread_inverse_distance(r, sigma_));
}

double NearField::normal_compliance(double r, double area) const {
  return normal_scale_ * cell_kernel(r, area);
}

double NearField::tangential_compliance(double r, double area) const {
  return tangential_scale_ * cell_kernel(r, area);
}

double NearField::drawn_normal(double r, double area) const {
  return normal_scale_ * point_kernel(r, area);
}

double NearField::drawn_tangential(double r, double area) const {
  return tangential_scale_ * point_kernel(r, area);
}

Vec3 NearField::drawn_displacement(const Vec3& offset, const Vec3& normal, double area,
                                   const Vec3& force) const {
  const double kernel = point_kernel(offset.norm(), area);
  return kernel * (tangential_scale_ * force +
                   (normal_scale_ - tangential_scale_) * normal.dot(force) * normal);
}

}  // namespace viscera
