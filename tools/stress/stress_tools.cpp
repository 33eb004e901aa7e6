#include "tools/stress/stress_tools.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "kernels/contact/cell_pattern.h"

namespace viscera {
namespace {

Vec3 normal_at(const TriangleSurface& surface, std::span<const Vec3> vertex_normals,
               const SurfacePoint& point) {
  const auto& corners = surface.triangles[static_cast<std::size_t>(point.triangle)];
  Vec3 sum = Vec3::Zero();
  for (std::size_t c = 0; c < 3; ++c)
    sum +=
        point.weights[static_cast<int>(c)] * vertex_normals[static_cast<std::size_t>(corners[c])];
  if (sum.norm() > 1e-9) return sum.normalized();
  return area_vector(surface, point.triangle).stableNormalized();
}

}  // namespace

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

StressTool tool_at(const StressBody& body, const SurfaceTree& tree,
                   std::span<const Vec3> vertex_normals, const Vec3& place, double radius,
                   int rings, bool held) {
  StressTool tool;
  tool.held = held;
  const SurfaceTree::Closest foot = tree.closest(place);
  const Vec3 up = normal_at(body.surface, vertex_normals, foot.point);
  const Vec3 e1 = up.unitOrthogonal(), e2 = up.cross(e1);
  const double pitch = 0.9 * radius / (rings + 0.1);
  for (const Vec2& o : hexagonal_grid(1.0, rings).places) {
    const Vec3 offset = pitch * (o.x() * e1 + o.y() * e2);
    const SurfaceTree::Closest under = tree.closest(foot.position + offset);
    ContactCell cell;
    cell.position = under.position;
    cell.normal = normal_at(body.surface, vertex_normals, under.point);
    cell.area = std::sqrt(0.75) * pitch * pitch;
    cell.held = held;
    cell.direction = -up;
    // The ball over the cell, its lowest point at the foot.
    const double flat =
        (cell.position - foot.position - up * up.dot(cell.position - foot.position)).squaredNorm();
    const double rise = radius - std::sqrt(std::max(0.0, radius * radius - flat));
    cell.depth = (cell.position - foot.position).dot(up) - rise;
    tool.cells.push_back(cell);
  }
  return tool;
}

std::vector<StressTool> random_tools(const StressBody& body, const SurfaceTree& tree,
                                     std::span<const Vec3> vertex_normals, Draws& draws) {
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
  Vec3 place = Vec3::Zero();
  for (int i = 0; i < count; ++i) {
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
    const bool held = where == 3 ? tools.back().held : draws.chance(0.3);
    const double radius = body.thickness * draws.log_uniform(0.03, 0.5);
    StressTool tool = tool_at(body, tree, vertex_normals, place, radius, 1 + draws.below(2), held);
    // Half the thickness exactly, once in three.
    tool.greatest_depth =
        body.thickness * (draws.chance(0.33) ? 0.5 : draws.log_uniform(1e-3, 0.5));
    const Vec3 pull = tool.greatest_depth * draws.direction();
    tool.pull = where == 3 ? tools.back().pull : pull;
    tool.with_last = where == 3;
    tool.place = fmt::format("{} {}", held ? "jaw" : "tip", said);
    tools.push_back(std::move(tool));
  }
  return tools;
}

}  // namespace viscera
