#include "engine/features/shafts/shaft_cells.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace viscera {
namespace {

/// As for tips: what is farther can't be reached in one frame [m].
constexpr double kGreatestGap = 2e-3;
/// Bounds of the line's half width, over the shaft's radius; the first before any force is known.
constexpr double kFirstWidth = 0.3, kLeastWidth = 0.08, kMostWidth = 0.97;
/// A width that changes by less stays: with it stay the cells, and what the tissue answers there.
constexpr double kSameWidth = 0.05;

}  // namespace

double half_width_under(double force, double pressed, double radius,
                        const IsotropicMaterial& material, double before) {
  if (!(force > 0.0) || !(pressed > 0.0)) return before;
  const double nu = material.poisson_ratio;
  const double modulus = material.youngs_modulus / (1.0 - nu * nu);
  const double found =
      std::clamp(std::sqrt(4.0 * force / pressed * radius / (std::numbers::pi * modulus)),
                 kLeastWidth * radius, kMostWidth * radius);
  return std::abs(found - before) < kSameWidth * before ? before : found;
}

bool lay_shaft_cells(const ShaftAbout& shaft, const ShaftRub& rub, const OrganModel& model,
                     const TissueContact& tissue, const TissueSheet& drawn, ShaftStretch& stretch,
                     std::vector<ContactCell>& cells, bool& unreached) {
  const double r = shaft.radius, length = stretch.to - stretch.from;
  if (!(stretch.half_width > 0.0)) stretch.half_width = kFirstWidth * r;
  const double width = 0.5 * std::numbers::e * stretch.half_width;
  const int count =
      std::clamp(static_cast<int>(std::lround(length / width)), 1, kMostCellsOfStretch);
  stretch.pitch = length / count;
  stretch.begin = cells.size();
  const double high = 4.0 * r;
  for (int i = 0; i < count; ++i) {
    const double s = stretch.from + (i + 0.5) * stretch.pitch;
    const Vec3 at = shaft.now.at(s), moved = at - shaft.before.at(s);
    Vec3 up = stretch.outward_at(s);
    up -= up.dot(shaft.now.direction) * shaft.now.direction;
    if (!(up.norm() > 0.5)) continue;
    up.normalize();
    Vec3 drag = Vec3::Zero();
    if (rub.cling) drag = rub.cling->followed * moved + rub.undrawn;
    drag -= drag.dot(up) * up;
    const double top = high + std::abs(moved.dot(up));
    const auto hit = drawn.cast(at - drag + top * up, -up, top + r + kGreatestGap);
    if (!hit) continue;
    const Vec3 lowest = at - r * up;
    // What lies higher than the shaft is something else that hangs over it.
    const double gap = (lowest - hit->position).dot(up);
    if (gap > kGreatestGap || gap < -2.0 * r - std::abs(moved.dot(up))) continue;
    ContactCell cell;
    cell.position = position(model.surface, hit->point);
    if (!tissue.touchable(cell.position)) {
      unreached = true;
      continue;
    }
    cell.normal = corner_mean(model.rest_normals, model.surface, hit->point).normalized();
    cell.area = stretch.pitch * width;
    cell.direction = -up;
    cell.depth = (lowest - cell.position).dot(cell.direction);
    cell.friction = rub.friction;
    if (rub.friction > 0.0) {
      cell.displacement = clinging_displacement(rub.cling, cell.position,
                                                hit->position + rub.undrawn - cell.position, moved);
      put_on_tool(up, cell);
    }
    stretch.along.push_back(s);
    stretch.points.push_back(hit->point);
    cells.push_back(cell);
  }
  stretch.end = cells.size();
  return stretch.end > stretch.begin;
}

}  // namespace viscera
