#include "kernels/contact/half_space.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace viscera {
namespace {

constexpr double kPi = std::numbers::pi;

/// exp(-x) I0(x), x >= 0, to 3e-7: [Abramowitz1964] 9.8.1 and 9.8.2. Scaled, so that nothing
/// overflows far from the cell. `decay`: exp(-x).
double scaled_bessel_i0(double x, double decay) {
  if (x < 3.75) {
    const double t = (x / 3.75) * (x / 3.75);
    return decay *
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

/// exp(-x) I1(x): 9.8.3 and 9.8.4.
double scaled_bessel_i1(double x, double decay) {
  if (x < 3.75) {
    const double t = (x / 3.75) * (x / 3.75);
    return decay * x *
           (0.5 +
            t * (0.87890594 +
                 t * (0.51498869 +
                      t * (0.15084934 + t * (0.02658733 + t * (0.00301532 + t * 0.00032411))))));
  }
  const double t = 3.75 / x;
  return (0.39894228 +
          t * (-0.03988024 +
               t * (-0.00362018 +
                    t * (0.00163801 +
                         t * (-0.01031555 +
                              t * (0.02282967 +
                                   t * (-0.02895312 + t * (0.01787654 - t * 0.00420059)))))))) /
         std::sqrt(x);
}

/// Complete elliptic integrals of the first and second kind, where 1 - k^2 is `m`, to 1e-12, by
/// means that meet [Abramowitz1964] 17.6: some thirty times as fast as the library's.
struct Elliptic {
  double first = 0.0;  // times m, which is finite where k is 1
  double second = 0.0;
};
Elliptic elliptic(double m) {
  if (m <= 0.0) return {0.0, 1.0};
  double a = 1.0, b = std::sqrt(m), weight = 0.5, sum = 0.5 * (1.0 - m);
  // They meet to 1e-8, and with them their squares to 1e-16.
  while (a - b > 1e-8 * a) {
    const double half = 0.5 * (a - b), mean = 0.5 * (a + b);
    b = std::sqrt(a * b);
    a = mean;
    weight *= 2.0;
    sum += weight * half * half;
  }
  const double first = kPi / (a + b);
  return {m * first, first * (1.0 - sum)};
}

/// Overlap of two unit discs whose centres are d apart.
double lens_area(double d) {
  if (d >= 2.0) return 0.0;
  return 2.0 * std::acos(0.5 * d) - 0.5 * d * std::sqrt(4.0 - d * d);
}

/// K_m of two unit discs d apart. x - y is distributed as the overlap of the discs shifted by it,
/// so in polar coordinates about the singularity one smooth integral is left.
RadialKernels disc_to_disc_by_quadrature(double d) {
  constexpr int kAngles = 96, kRadii = 96;
  RadialKernels sum;
  for (int i = 0; i < kAngles; ++i) {
    const double cosine = std::cos(kPi * (i + 0.5) / kAngles);
    // Where the ray leaves (and, from outside, enters) the disc of radius 2 that holds the overlap.
    const double root2 = 4.0 - d * d * (1.0 - cosine * cosine);
    if (root2 <= 0.0) continue;
    const double begin = std::max(0.0, -d * cosine - std::sqrt(root2));
    const double end = -d * cosine + std::sqrt(root2);
    if (end <= begin) continue;
    const double step = (end - begin) / kRadii;
    double ray = 0.0;
    for (int j = 0; j < kRadii; ++j) {
      const double r = begin + (j + 0.5) * step;
      ray += step * lens_area(std::sqrt(std::max(0.0, d * d + r * r + 2.0 * d * r * cosine)));
    }
    sum.monopole += ray;
    sum.dipole -= ray * cosine;
    sum.quadrupole += ray * (2.0 * cosine * cosine - 1.0);
  }
  return sum * (2.0 * (kPi / kAngles) / (kPi * kPi));
}

/// Discs nearer than this many radii take the table, farther ones the multipole series.
constexpr double kTableEnd = 4.0;
constexpr int kTableSteps = 64;
using Table = std::array<RadialKernels, kTableSteps + 3>;

const Table& disc_to_disc_table() {
  static const Table table = [] {
    Table values;
    for (int i = 1; i < kTableSteps + 3; ++i) {
      values[static_cast<std::size_t>(i)] =
          disc_to_disc_by_quadrature((i - 1) * kTableEnd / kTableSteps);
    }
    values[1] = {16.0 / (3.0 * kPi), 0.0, 0.0};  // the cell itself, exactly
    values[0] = {values[2].monopole, -values[2].dipole, values[2].quadrupole};
    return values;
  }();
  return table;
}

double cubic(double a, double b, double e, double f, double s) {
  return b +
         0.5 * s * (e - a + s * (2.0 * a - 5.0 * b + 4.0 * e - f + s * (3.0 * (b - e) + f - a)));
}

}  // namespace

RadialKernels disc_to_disc(double r, double c) {
  const double d = r / c;
  if (d >= kTableEnd) {
    // The mean over both discs is 1 + c^2 lap / 4 + 5 c^4 lap^2 / 192 + ... of the point's field,
    // and lap (r^-p cos m a) = (p^2 - m^2) r^-(p + 2) cos m a.
    const double t = 1.0 / (d * d), inverse = 1.0 / r;
    return {inverse * (1.0 + t * (0.25 + t * (45.0 / 192.0 + t * (1575.0 / 4608.0 + t * 0.628)))),
            inverse,
            inverse * (1.0 - t * (0.75 + t * (75.0 / 192.0 + t * (2205.0 / 4608.0 + t * 0.8075))))};
  }
  const Table& table = disc_to_disc_table();
  const double place = d * kTableSteps / kTableEnd;
  const auto i = static_cast<std::size_t>(place);
  const double s = place - static_cast<double>(i);
  const RadialKernels &a = table[i], &b = table[i + 1], &e = table[i + 2], &f = table[i + 3];
  const double inverse = 1.0 / c;
  return {inverse * cubic(a.monopole, b.monopole, e.monopole, f.monopole, s),
          // Two discs that don't overlap are to each other as points.
          d >= 2.0 ? 1.0 / r : inverse * cubic(a.dipole, b.dipole, e.dipole, f.dipole, s),
          inverse * cubic(a.quadrupole, b.quadrupole, e.quadrupole, f.quadrupole, s)};
}

RadialKernels disc_to_point(double r, double c) {
  const double d = r / c;
  if (d >= kTableEnd) {
    const double t = 1.0 / (d * d), inverse = 1.0 / r;
    return {inverse * (1.0 + t * (0.125 + t * (9.0 / 192.0 + t * (225.0 / 9216.0 + t * 0.01495)))),
            inverse,
            inverse * (1.0 - t * (0.375 + t * (15.0 / 192.0 + t * (0.03418 + t * 0.01923))))};
  }
  if (d <= 1.0) {
    const double k2 = d * d;
    const auto [first, second] = elliptic(1.0 - k2);
    // The closed form cancels near the centre.
    const double quadrupole = d < 0.1
                                  ? 0.25 * k2 * (1.0 + 0.25 * k2)
                                  : 4.0 / (3.0 * kPi * k2) * ((2.0 - k2) * second - 2.0 * first);
    return {4.0 * second / (kPi * c), d / c, quadrupole / c};
  }
  const double k = 1.0 / d, k2 = k * k;
  const auto [first, second] = elliptic(1.0 - k2);
  return {4.0 * d / (kPi * c) * (second - first), 1.0 / r,
          4.0 * d / (3.0 * kPi * c) * ((2.0 * k2 - 1.0) * second + first)};
}

RadialKernels gaussian_to_point(double r, double s) {
  const double x = r * r / (4.0 * s * s);
  const double scale = std::sqrt(0.5 * kPi) / s;
  const double decay = std::exp(-x);
  // Near the centre 1 - exp(-2 x) would cancel.
  const double gone = x < 0.1 ? -std::expm1(-2.0 * x) : 1.0 - decay * decay;
  return {scale * scaled_bessel_i0(x, decay), r > 0.0 ? gone / r : 0.0,
          scale * scaled_bessel_i1(x, decay)};
}

HalfSpace::HalfSpace(const IsotropicMaterial& material) {
  const double nu = material.poisson_ratio;
  const double scale = 1.0 / (2.0 * kPi * material.shear_modulus());
  normal_ = scale * (1.0 - nu);
  mean_tangential_ = scale * (1.0 - 0.5 * nu);
  turning_ = scale * 0.5 * nu;
  coupling_ = scale * (0.5 - nu);
}

double HalfSpace::tail_scale() const {
  return std::max(normal_, mean_tangential_ + 3.0 * turning_);
}

HalfSpace::Parts HalfSpace::parts(const RadialKernels& kernels, const Vec3& offset,
                                  const Vec3& normal) const {
  Vec3 along = offset - normal.dot(offset) * normal;
  const double length = along.norm();
  along = length > 0.0 ? Vec3(along / length) : Vec3(Vec3::Zero());
  return {along, mean_tangential_ * kernels.monopole,
          length > 0.0 ? turning_ * kernels.quadrupole : 0.0, coupling_ * kernels.dipole};
}

Mat3 HalfSpace::response(const RadialKernels& kernels, const Vec3& offset,
                         const Vec3& normal) const {
  const auto [along, mean, turn, mixed] = parts(kernels, offset, normal);
  const Mat3 coupled = mixed * along * normal.transpose();
  return (mean - turn) * Mat3::Identity() +
         (normal_ * kernels.monopole - mean + turn) * normal * normal.transpose() +
         (2.0 * turn) * along * along.transpose() + coupled - coupled.transpose();
}

Vec3 HalfSpace::displacement(const RadialKernels& kernels, const Vec3& offset, const Vec3& normal,
                             const Vec3& force) const {
  const auto [along, mean, turn, mixed] = parts(kernels, offset, normal);
  const double pushed = normal.dot(force), dragged = along.dot(force);
  return (mean - turn) * force +
         ((normal_ * kernels.monopole - mean + turn) * pushed - mixed * dragged) * normal +
         (2.0 * turn * dragged + mixed * pushed) * along;
}

}  // namespace viscera
