#include "kernels/smoke/sight.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace viscera {
namespace {

constexpr int kPoints = 32;  // of the disc
constexpr double kStepsPerCell =
    2;  // the density is linear within a cell: its midpoints see it well

double density_at(const SmokeGrid& grid, const Vec3& point) {
  const Vec3 at = (point - grid.domain.min()) / grid.voxel - Vec3::Constant(0.5);
  Eigen::Vector3i low, high;
  Vec3 share;
  for (int a = 0; a < 3; ++a) {
    const double inside = std::clamp(at[a], 0.0, static_cast<double>(grid.size[a] - 1));
    low[a] = std::min(static_cast<int>(inside), grid.size[a] - 1);
    high[a] = std::min(low[a] + 1, grid.size[a] - 1);
    share[a] = inside - low[a];
  }
  const auto value = [&](int x, int y, int z) {
    return static_cast<double>(
        grid.density[x + static_cast<std::size_t>(grid.size.x()) *
                             (y + static_cast<std::size_t>(grid.size.y()) * z)]);
  };
  double sum = 0.0;
  for (int corner = 0; corner < 8; ++corner) {
    const bool x = corner & 1, y = corner & 2, z = corner & 4;
    sum += (x ? share.x() : 1.0 - share.x()) * (y ? share.y() : 1.0 - share.y()) *
           (z ? share.z() : 1.0 - share.z()) *
           value(x ? high.x() : low.x(), y ? high.y() : low.y(), z ? high.z() : low.z());
  }
  return sum;
}

/// Smoke an area on the way through one grid [kg/m2].
double column(const SmokeGrid& grid, const Vec3& from, const Vec3& to) {
  if (grid.density.empty()) return 0.0;
  const Vec3 way = to - from;
  double enter = 0.0, leave = 1.0;
  for (int a = 0; a < 3; ++a) {
    const double low = grid.domain.min()[a] - from[a], high = grid.domain.max()[a] - from[a];
    if (way[a] == 0.0) {
      if (low > 0.0 || high < 0.0) return 0.0;
      continue;
    }
    enter = std::max(enter, std::min(low / way[a], high / way[a]));
    leave = std::min(leave, std::max(low / way[a], high / way[a]));
  }
  if (leave <= enter) return 0.0;
  const double length = (leave - enter) * way.norm();
  const int steps = std::max(1, static_cast<int>(std::ceil(kStepsPerCell * length / grid.voxel)));
  double sum = 0.0;
  for (int i = 0; i < steps; ++i)
    sum += density_at(grid, from + (enter + (leave - enter) * (i + 0.5) / steps) * way);
  return sum * length / steps;
}

}  // namespace

double optical_depth(const SmokyCavity& cavity, const Vec3& from, const Vec3& to) {
  double smoke = cavity.background * (to - from).norm();
  for (const SmokeGrid* grid : cavity.grids) smoke += column(*grid, from, to);
  return cavity.optics.mass_extinction * smoke;
}

double mean_transmittance(const SmokyCavity& cavity, const Vec3& lens, const Vec3& tip,
                          double radius) {
  const Vec3 sight = tip - lens;
  if (sight.norm() == 0.0) return 1.0;
  const Vec3 across = sight.unitOrthogonal();
  const Vec3 up = sight.normalized().cross(across);
  double sum = 0.0;
  for (int i = 0; i < kPoints; ++i) {
    // A sunflower's seeds: even over the disc.
    const double r = radius * std::sqrt((i + 0.5) / kPoints);
    const double turn = i * std::numbers::pi * (3.0 - std::sqrt(5.0));
    const Vec3 point = tip + r * (std::cos(turn) * across + std::sin(turn) * up);
    sum += std::exp(-optical_depth(cavity, lens, point));
  }
  return sum / kPoints;
}

}  // namespace viscera
