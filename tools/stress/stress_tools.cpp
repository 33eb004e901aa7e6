#include "tools/stress/stress_tools.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <utility>

#include "kernels/contact/cell_pattern.h"

namespace viscera {
namespace {

std::vector<Vec3f> in_single(std::span<const Vec3> positions) {
  std::vector<Vec3f> single;
  for (const Vec3& x : positions) single.push_back(x.cast<float>());
  return single;
}

Vec3 normal_at(const StressSurface& surface, const SurfacePoint& point) {
  const TriangleSurface& rest = surface.body.surface;
  const auto& corners = rest.triangles[static_cast<std::size_t>(point.triangle)];
  Vec3 sum = Vec3::Zero();
  for (std::size_t c = 0; c < 3; ++c)
    sum +=
        point.weights[static_cast<int>(c)] * surface.normals[static_cast<std::size_t>(corners[c])];
  if (sum.norm() > 1e-9) return sum.normalized();
  return area_vector(rest, point.triangle).stableNormalized();
}

/// The surface on the line through `at` along `up`, from above, within `span` of it.
std::optional<CollisionSurface::Hit> tissue_under(const StressSurface& surface, const Vec3& at,
                                                  const Vec3& up, double span) {
  return surface.search.cast(at + span * up, -up, 2.0 * span);
}

/// Mean normal of the tissue about a foot, as find_foot() (contact_cells.cpp) takes it.
Vec3 outward_about(const StressSurface& surface, const Vec3& foot, Vec3 up, double radius) {
  const std::vector<double>& spacings = surface.body.cloud.spacings;
  const double finest = *std::min_element(spacings.begin(), spacings.end());
  const double ring = std::max(2.0 * radius, 1.2 * finest);
  for (int pass = 0; pass < 2; ++pass) {
    const Vec3 e1 = up.unitOrthogonal(), e2 = up.cross(e1);
    Vec3 sum = Vec3::Zero();
    for (int i = 0; i < 12; ++i) {
      const double angle = std::numbers::pi * i / 6.0, r = i % 2 == 0 ? ring : 0.6 * ring;
      const Vec3 at = foot + r * (std::cos(angle) * e1 + std::sin(angle) * e2);
      if (const auto hit = tissue_under(surface, at, up, 2.0 * ring))
        sum += normal_at(surface, hit->point);
    }
    if (sum.norm() > 1.0) up = sum.normalized();
  }
  return up;
}

/// Where the cells of a foot are to be, in its plane: a tip's patch is as wide as it may become; a
/// jaw's answers as a disc of its radius.
CellPattern pattern_of(double radius, int rings, bool held, double poisson_ratio) {
  CellPattern pattern = hexagonal_grid(1.0, rings);
  if (held) return fitted_to_punch(std::move(pattern), radius, poisson_ratio, true);
  const double pitch = 0.9 * radius / (rings + 0.1);
  for (Vec2& place : pattern.places) place *= pitch;
  for (double& area : pattern.areas) area *= pitch * pitch;
  return pattern;
}

}  // namespace

StressSurface::StressSurface(const StressBody& whole)
    : body(whole),
      normals(vertex_normals(whole.surface)),
      search(whole.surface, in_single(whole.surface.vertices)) {}

void StressTool::add_cells(double share, double angle, std::vector<ContactCell>& out) const {
  const Vec3 way = Eigen::AngleAxisd(angle, cells.front().normal.normalized()) * Vec3(share * pull);
  for (ContactCell cell : cells) {
    if (held) {
      cell.displacement = way;
    } else {
      cell.depth += share * greatest_depth;
    }
    out.push_back(cell);
  }
}

double StressTool::clearance() const {
  double deepest = 0.0;
  for (const ContactCell& cell : cells) deepest = std::max(deepest, cell.depth);
  return deepest;
}

StressTool tool_at(const StressSurface& surface, const Vec3& place, double radius, int rings,
                   bool held) {
  const StressBody& body = surface.body;
  StressTool tool;
  tool.held = held;
  const auto foot = surface.search.closest(place, 4.0 * body.size);
  if (!foot) return tool;
  const Vec3 up = outward_about(surface, foot->position, normal_at(surface, foot->point), radius);
  const Vec3 e1 = up.unitOrthogonal(), e2 = up.cross(e1);
  const CellPattern pattern = pattern_of(radius, rings, held, body.material.poisson_ratio);
  for (std::size_t i = 0; i < pattern.places.size(); ++i) {
    const Vec2& o = pattern.places[i];
    const auto under = tissue_under(surface, foot->position + o.x() * e1 + o.y() * e2, up,
                                    2.0 * radius + 0.1 * body.thickness);
    if (!under) continue;
    ContactCell cell;
    cell.position = position(body.surface, under->point);
    cell.normal = normal_at(surface, under->point);
    cell.area = pattern.areas[i];
    cell.held = held;
    cell.direction = -up;
    // The ball over the cell, its lowest point at the foot.
    const double rise = radius - std::sqrt(std::max(0.0, radius * radius - o.squaredNorm()));
    cell.depth = (cell.position - foot->position).dot(up) - rise;
    tool.cells.push_back(cell);
  }
  return tool;
}

std::vector<StressTool> random_tools(const StressSurface& surface, Draws& draws) {
  const StressBody& body = surface.body;
  std::vector<std::size_t> reachable;
  const auto corner = [&](std::size_t t, std::size_t c) -> const Vec3& {
    return body.surface.vertices[static_cast<std::size_t>(body.surface.triangles[t][c])];
  };
  for (std::size_t t = 0; t < body.surface.triangles.size(); ++t)
    if (body.is_touchable((corner(t, 0) + corner(t, 1) + corner(t, 2)) / 3.0))
      reachable.push_back(t);
  std::vector<StressTool> tools;
  if (reachable.empty()) return tools;

  const int count = 1 + draws.below(3);
  // Where none of those has anything under it, until one has.
  constexpr int kTries = 100;
  Vec3 place = Vec3::Zero();
  for (int i = 0; i < count || (tools.empty() && i < kTries); ++i) {
    const std::size_t t =
        reachable[static_cast<std::size_t>(draws.below(static_cast<int>(reachable.size())))];
    const auto c = static_cast<std::size_t>(draws.below(3));
    const int where = draws.below(i > 0 ? 4 : 3);
    std::string said;
    if (where == 0) {
      const double u = draws.uniform(), v = draws.uniform() * (1.0 - u);
      place = corner(t, 0) + u * (corner(t, 1) - corner(t, 0)) + v * (corner(t, 2) - corner(t, 0));
      said = fmt::format("in triangle {}", t);
    } else if (where == 1) {
      place = corner(t, c);
      said = fmt::format("at vertex {}", body.surface.triangles[t][c]);
    } else if (where == 2) {
      place = 0.5 * (corner(t, c) + corner(t, (c + 1) % 3));
      said = fmt::format("on an edge of triangle {}", t);
    } else {
      said = "where the one before stands";
    }
    const bool again = where == 3 && !tools.empty();
    const bool held = again ? tools.back().held : draws.chance(0.3);
    const double radius = body.thickness * draws.log_uniform(0.03, 0.5);
    // The engine presses with three rings and grasps with two.
    const int rings = held ? 2 : 1 + draws.below(3);
    StressTool tool = tool_at(surface, place, radius, rings, held);
    // A ridge may have nothing straight under its foot, as in a scene.
    if (tool.cells.empty()) continue;
    // Half the thickness exactly, once in three.
    tool.greatest_depth =
        body.thickness * (draws.chance(0.33) ? 0.5 : draws.log_uniform(1e-3, 0.5));
    const Vec3 pull = tool.greatest_depth * draws.direction();
    tool.pull = again ? tools.back().pull : pull;
    tool.with_last = again;
    tool.place = fmt::format("{} {}", held ? "jaw" : "tip", said);
    tools.push_back(std::move(tool));
  }
  return tools;
}

}  // namespace viscera
