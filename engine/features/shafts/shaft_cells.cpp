#include "engine/features/shafts/shaft_cells.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

namespace viscera {
namespace {

/// As for tips: what is farther can't be reached in one frame [m].
constexpr double kGreatestGap = 2e-3;
/// Bounds of the line's half width, over the shaft's radius; the first before any force is known.
constexpr double kFirstWidth = 0.3, kLeastWidth = 0.08, kMostWidth = 0.97;
/// A width that changes by less stays: with it stay the cells, and what the tissue answers there.
constexpr double kSameWidth = 0.05;

/// An end of a row is found to this share of its width.
constexpr double kEndStep = 0.25;

/// The tissue under a shaft.
class Under {
 public:
  Under(const ShaftAbout& shaft, const ShaftRub& rub, const TissueSheet& drawn,
        const ShaftStretch& stretch)
      : shaft_(shaft), rub_(rub), drawn_(drawn), stretch_(stretch) {}

  struct Place {
    Vec3 up, lowest, moved;  // of the shaft there
    TissueSheet::Hit hit;
  };
  /// Nothing: it ends before, lies too far off, or what is found hangs over the shaft.
  std::optional<Place> find(double s) const {
    Place place;
    const Vec3 at = shaft_.now.at(s);
    place.moved = at - shaft_.before.at(s);
    Vec3 up = stretch_.outward_at(s);
    up -= up.dot(shaft_.now.direction) * shaft_.now.direction;
    if (!(up.norm() > 0.5)) return std::nullopt;
    place.up = up.normalized();
    Vec3 drag = Vec3::Zero();
    if (rub_.cling) drag = rub_.cling->followed * place.moved + rub_.undrawn;
    drag -= drag.dot(place.up) * place.up;
    const double r = shaft_.radius, went = std::abs(place.moved.dot(place.up));
    const double top = 4.0 * r + went;
    const auto hit = drawn_.cast(at - drag + top * place.up, -place.up, top + r + kGreatestGap);
    if (!hit) return std::nullopt;
    place.hit = *hit;
    place.lowest = at - r * place.up;
    const double gap = (place.lowest - hit->position).dot(place.up);
    if (gap > kGreatestGap || gap < -2.0 * r - went) return std::nullopt;
    return place;
  }

 private:
  const ShaftAbout& shaft_;
  const ShaftRub& rub_;
  const TissueSheet& drawn_;
  const ShaftStretch& stretch_;
};

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
  if (!(stretch.half_width > 0.0)) stretch.half_width = kFirstWidth * shaft.radius;
  const double width = 0.5 * std::numbers::e * stretch.half_width;
  const Under under(shaft, rub, drawn, stretch);
  // The row ends where the tissue does: a cell that hangs over an edge leaves the edge unpressed.
  double from = stretch.from, to = stretch.to;
  while (from < to && !under.find(from)) from += kEndStep * width;
  while (from < to && !under.find(to)) to -= kEndStep * width;
  if (!(from < to)) return false;
  const double length = to - from;
  const int count =
      std::clamp(static_cast<int>(std::lround(length / width)), 1, kMostCellsOfStretch);
  stretch.pitch = length / count;
  stretch.begin = cells.size();
  for (int i = 0; i < count; ++i) {
    const double s = from + (i + 0.5) * stretch.pitch;
    const auto place = under.find(s);
    if (!place) continue;
    ContactCell cell;
    cell.position = position(model.surface, place->hit.point);
    if (!tissue.touchable(cell.position)) {
      unreached = true;
      continue;
    }
    cell.normal = corner_mean(model.rest_normals, model.surface, place->hit.point).normalized();
    cell.area = stretch.pitch * width;
    cell.direction = -place->up;
    cell.depth = (place->lowest - cell.position).dot(cell.direction);
    cell.friction = rub.friction;
    if (rub.friction > 0.0) {
      cell.displacement =
          clinging_displacement(rub.cling, cell.position,
                                place->hit.position + rub.undrawn - cell.position, place->moved);
      put_on_tool(place->up, cell);
    }
    stretch.along.push_back(s);
    stretch.points.push_back(place->hit.point);
    cells.push_back(cell);
  }
  stretch.end = cells.size();
  return stretch.end > stretch.begin;
}

}  // namespace viscera
