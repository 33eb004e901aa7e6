#include "kernels/contact/cell_pattern.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "kernels/contact/half_space.h"

namespace viscera {
namespace {

constexpr double kPi = std::numbers::pi;

/// F / (G a d) of a rigid flat punch.
double punch_stiffness(double poisson_ratio, bool sticks) {
  if (!sticks) return 4.0 / (1.0 - poisson_ratio);
  // ln(1 + 2 e) / e with e = 1 - 2 nu tends to 2 as the body becomes incompressible.
  const double e = 1.0 - 2.0 * poisson_ratio;
  return 4.0 * (e > 0.0 ? std::log1p(2.0 * e) / e : 2.0);
}

}  // namespace

CellPattern ringed_disc(double radius, int rings) {
  const int count = 1 + 3 * rings * (rings + 1);
  CellPattern pattern;
  for (int ring = 0; ring <= rings; ++ring) {
    // The cells inside a ring cover their share of the disc; a cell sits at the middle of its band.
    const int inner = ring == 0 ? 0 : 1 + 3 * ring * (ring - 1);
    const int in_ring = ring == 0 ? 1 : 6 * ring;
    const auto radius_inside = [&](int number) {
      return radius * std::sqrt(static_cast<double>(number) / count);
    };
    const double r =
        ring == 0 ? 0.0 : 0.5 * (radius_inside(inner) + radius_inside(inner + in_ring));
    for (int i = 0; i < in_ring; ++i) {
      const double angle = 2.0 * kPi * (i + 0.5 * (ring % 2)) / in_ring;
      pattern.places.emplace_back(r * std::cos(angle), r * std::sin(angle));
      pattern.areas.push_back(kPi * radius * radius / count);
    }
  }
  return pattern;
}

CellPattern hexagonal_grid(double pitch, int rings) {
  CellPattern pattern;
  pattern.places.push_back(Vec2::Zero());
  for (int q = -rings; q <= rings; ++q) {
    for (int r = -rings; r <= rings; ++r) {
      if (std::abs(q + r) > rings || (q == 0 && r == 0)) continue;
      pattern.places.push_back(pitch * Vec2(q + 0.5 * r, std::sqrt(0.75) * r));
    }
  }
  pattern.areas.assign(pattern.places.size(), std::sqrt(0.75) * pitch * pitch);
  return pattern;
}

double punch_radius(const CellPattern& pattern, double poisson_ratio, bool sticks) {
  const IsotropicMaterial material{2.0 * (1.0 + poisson_ratio), poisson_ratio};  // G = 1
  const HalfSpace half_space(material);
  const auto n = static_cast<Eigen::Index>(pattern.places.size());
  const Eigen::Index parts = sticks ? 3 : 1;
  MatrixX matrix(parts * n, parts * n);
  for (Eigen::Index k = 0; k < n; ++k) {
    for (Eigen::Index l = 0; l <= k; ++l) {
      const auto one = static_cast<std::size_t>(k), other = static_cast<std::size_t>(l);
      const Vec2 offset = pattern.places[one] - pattern.places[other];
      const double area = 0.5 * (pattern.areas[one] + pattern.areas[other]);
      const Mat3 response = half_space.response(disc_to_disc(offset.norm(), std::sqrt(area / kPi)),
                                                Vec3(offset.x(), offset.y(), 0.0), Vec3::UnitZ());
      const auto part = response.bottomRightCorner(parts, parts);
      matrix.block(parts * k, parts * l, parts, parts) = part;
      matrix.block(parts * l, parts * k, parts, parts) = part.transpose();
    }
  }
  VectorX unit = VectorX::Zero(parts * n);
  unit(Eigen::seqN(parts - 1, n, parts)).setOnes();
  return unit.dot(matrix.llt().solve(unit)) / punch_stiffness(poisson_ratio, sticks);
}

CellPattern fitted_to_punch(CellPattern pattern, double radius, double poisson_ratio, bool sticks) {
  const double scale = radius / punch_radius(pattern, poisson_ratio, sticks);
  for (Vec2& place : pattern.places) place *= scale;
  for (double& area : pattern.areas) area *= scale * scale;
  return pattern;
}

double ball_pattern_radius(double radius, double depth) {
  const double touching = std::sqrt(radius * std::max(0.0, depth));
  return std::clamp(1.35 * touching + 0.15 * radius, 0.3 * radius, 0.97 * radius);
}

}  // namespace viscera
