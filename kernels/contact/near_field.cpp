#include "kernels/contact/near_field.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace viscera {
namespace {

double disc_radius(double area) {
  return std::sqrt(area / std::numbers::pi);
}

/// 1, falling smoothly to 0 over the last quarter of the range.
double taper(double r, double range) {
  const double t = std::clamp(4.0 * (1.0 - r / range), 0.0, 1.0);
  return t * t * (3.0 - 2.0 * t);
}

}  // namespace

NearField::NearField(const IsotropicMaterial& material, double sigma)
    : half_space_(material), sigma_(sigma) {}

double NearField::range() const {
  // Far off, the spread K_0 exceeds 1/r by sigma^2 / r^3; at r = sigma the two differ by
  // 0.215 / sigma: (1 / (0.215e-3))^(1/3) = 16.7. K_2 falls short by three times as much, and K_1
  // by a Gaussian.
  return 16.7 * sigma_;
}

double NearField::drawn_range(double force) const {
  // The tail is sigma^2 / (2 r^3), and that is its size within a third from 3 sigma on.
  constexpr double kInvisible = 1e-6;
  const double tail =
      std::cbrt(force * half_space_.tail_scale() * sigma_ * sigma_ / (2.0 * kInvisible));
  return std::min(range(), std::max(3.0 * sigma_, 1.1 * tail));
}

RadialKernels NearField::cell_kernels(double r, double area) const {
  if (r >= range()) return {};
  return (disc_to_disc(r, disc_radius(area)) - gaussian_to_point(r, std::numbers::sqrt2 * sigma_)) *
         taper(r, range());
}

RadialKernels NearField::point_kernels(double r, double area) const {
  if (r >= range()) return {};
  return (disc_to_point(r, disc_radius(area)) - gaussian_to_point(r, sigma_)) * taper(r, range());
}

Mat3 NearField::cell_response(const Vec3& offset, const Vec3& normal, double area) const {
  return half_space_.response(cell_kernels(offset.norm(), area), offset, normal);
}

Vec3 NearField::drawn_displacement(const Vec3& offset, const Vec3& normal, double area,
                                   const Vec3& force) const {
  return half_space_.displacement(point_kernels(offset.norm(), area), offset, normal, force);
}

}  // namespace viscera
