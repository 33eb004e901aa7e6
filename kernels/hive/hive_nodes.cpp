#include "kernels/hive/hive_nodes.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace viscera {
namespace {

/// Ring j of r lies at (j / r)^kRingGrading of the radius, layers likewise.
constexpr double kRingGrading = 1.2, kLayerGrading = 1.5;
/// Of the depth at which layers would meet, where no depth is asked for.
constexpr double kDeepest = 0.7;

}  // namespace

HivePattern::HivePattern(int most_nodes) {
  rings_ = 1;
  for (int rings = 2; most_nodes / (1 + 3 * rings * (rings + 1)) >= rings; ++rings) rings_ = rings;
  layers_ = std::clamp(most_nodes / ring_nodes(), 2, rings_ + 3);

  for (int ring = 0; ring <= rings_; ++ring) {
    const double r = std::pow(static_cast<double>(ring) / rings_, kRingGrading);
    for (int i = 0; i < std::max(1, 6 * ring); ++i) {
      const double angle = ring == 0 ? 0.0 : std::numbers::pi * i / (3.0 * ring);
      places_.emplace_back(r * std::cos(angle), r * std::sin(angle));
    }
  }
  const auto node = [](int ring, int i) {
    return ring == 0 ? 0 : 1 + 3 * ring * (ring - 1) + i % (6 * ring);
  };
  for (int sixth = 0; sixth < 6; ++sixth) {
    for (int ring = 1; ring <= rings_; ++ring) {
      const int outer = sixth * ring, inner = sixth * (ring - 1);
      for (int k = 0; k < ring; ++k)
        triangles_.push_back(
            {node(ring - 1, inner + k), node(ring, outer + k), node(ring, outer + k + 1)});
      for (int k = 0; k + 1 < ring; ++k)
        triangles_.push_back(
            {node(ring - 1, inner + k), node(ring, outer + k + 1), node(ring - 1, inner + k + 1)});
    }
  }
  for (int layer = 0; layer < layers_; ++layer)
    depths_.push_back(std::pow(static_cast<double>(layer) / (layers_ - 1), kLayerGrading));
}

PatternPlace HivePattern::locate(const Vec2& place) const noexcept {
  const double angle = std::atan2(place.y(), place.x()) * 3.0 / std::numbers::pi;
  const int sixth = static_cast<int>(std::floor(angle) + 6.0) % 6;
  const std::size_t each = triangles_.size() / 6;
  PatternPlace best;
  double most_inside = -std::numeric_limits<double>::infinity();
  for (std::size_t t = static_cast<std::size_t>(sixth) * each, end = t + each; t < end; ++t) {
    const auto& corners = triangles_[t];
    const Vec2& a = places_[static_cast<std::size_t>(corners[0])];
    const Vec2 u = places_[static_cast<std::size_t>(corners[1])] - a,
               v = places_[static_cast<std::size_t>(corners[2])] - a, p = place - a;
    const double whole = u.x() * v.y() - u.y() * v.x();
    const double second = (p.x() * v.y() - p.y() * v.x()) / whole,
                 third = (u.x() * p.y() - u.y() * p.x()) / whole;
    const double least = std::min({1.0 - second - third, second, third});
    if (least > most_inside) {
      most_inside = least;
      best = {corners, {1.0 - second - third, second, third}};
    }
  }
  if (most_inside < 0.0) {
    double sum = 0.0;
    for (double& weight : best.weights) sum += weight = std::max(0.0, weight);
    for (double& weight : best.weights) weight /= sum;
  }
  return best;
}

HiveNodes::HiveNodes(const HivePattern& pattern)
    : positions(static_cast<std::size_t>(pattern.nodes())),
      normals(static_cast<std::size_t>(pattern.ring_nodes())),
      areas(static_cast<std::size_t>(pattern.ring_nodes())) {}

HiveVerdict HiveNodes::place(const HivePattern& pattern, const WalkableSurface& surface,
                             const SurfaceSpot& spot, double wanted_radius, double depth) noexcept {
  if (!spot.on_surface() ||
      static_cast<std::size_t>(spot.point.triangle) >= surface.surface().triangles.size())
    return HiveVerdict::kNotOnSurface;
  if (!spot.point.weights.allFinite()) return HiveVerdict::kNotFinite;
  centre = surface.at(spot.point);
  if (!centre.position.allFinite() || !centre.normal.allFinite()) return HiveVerdict::kNotFinite;
  radius = wanted_radius;
  along_x = centre.normal.unitOrthogonal();
  along_y = centre.normal.cross(along_x);
  const auto m = normals.size();
  double deepest = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < m; ++i) {
    const Vec2& at = pattern.places()[i];
    SurfaceSpot node = centre;
    if (surface.straight(radius * (at.x() * along_x + at.y() * along_y), node) != WalkEnd::kFound)
      return HiveVerdict::kNotOnSurface;
    normals[i] = node.normal;
    positions[i] = node.position;
    areas[i] = 0.0;
  }
  for (const auto& corners : pattern.triangles()) {
    const auto a = static_cast<std::size_t>(corners[0]), b = static_cast<std::size_t>(corners[1]),
               c = static_cast<std::size_t>(corners[2]);
    const Vec3 area = 0.5 * (positions[b] - positions[a]).cross(positions[c] - positions[a]);
    // Around an edge or the rim of a thin body the surface turns its back on the centre.
    if (!(area.dot(normals[a] + normals[b] + normals[c]) > 0.0)) return HiveVerdict::kFolded;
    for (const std::size_t i : {a, b, c}) areas[i] += area.norm() / 3.0;
    // An edge e between normals that differ by dn is e - d dn at depth d: shorter where the body is
    // round, turned back beyond the centre.
    for (const auto& [one, other] : {std::pair(a, b), std::pair(b, c), std::pair(c, a)}) {
      const Vec3 edge = positions[other] - positions[one];
      const double shrinks = edge.dot(normals[other] - normals[one]);
      if (shrinks > 0.0) deepest = std::min(deepest, edge.squaredNorm() / shrinks);
    }
  }
  if (depth >= deepest) return HiveVerdict::kFolded;
  if (depth == 0.0) depth = std::min(wanted_radius, kDeepest * deepest);
  for (std::size_t layer = 1; layer < pattern.depths().size(); ++layer)
    for (std::size_t i = 0; i < m; ++i)
      positions[layer * m + i] = positions[i] - depth * pattern.depths()[layer] * normals[i];
  return HiveVerdict::kSound;
}

Vec2 HiveNodes::in_disc(const Vec3& point) const noexcept {
  const Vec3 offset = point - centre.position;
  const Vec2 flat(along_x.dot(offset), along_y.dot(offset));
  const double length = flat.norm();
  if (!(length > 0.0)) return Vec2::Zero();
  return flat * (offset.norm() / (length * radius));
}

}  // namespace viscera
