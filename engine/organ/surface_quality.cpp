#include "engine/organ/surface_quality.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <vector>

#include "engine/organ/mesh_editor.h"
#include "kernels/base/parallel.h"
#include "kernels/points/surface_tree.h"

namespace viscera {
namespace {

constexpr std::size_t kMostWalls = 4000;  // vertices whose wall is measured

// How far it is from x inwards to the other side, by steps as long as nothing is nearer; nothing
// where what is met doesn't face x within 60 degrees: that is a bend, not a wall.
std::optional<double> wall_at(const TriangleSurface& surface, const SurfaceTree& tree,
                              const Vec3& x, const Vec3& n, double greatest, double edge) {
  double way = 0.25 * edge;  // past the triangles around x
  if (tree.signed_distance(x - way * n) > 0.0) return way;
  while (way < greatest) {
    const SurfaceTree::Closest closest = tree.closest(x - way * n);
    if (closest.distance < 0.02 * edge) {
      const Vec3 out = area_vector(surface, closest.point.triangle).normalized();
      return out.dot(n) < -0.5 ? std::optional(way) : std::nullopt;
    }
    way += 0.95 * closest.distance;
  }
  return std::nullopt;
}

void deepest_of(const TriangleSurface& of, const TriangleSurface& in, Overlap& overlap) {
  const Box box = bounds(in);
  std::vector<Vec3> inside_box;
  for (const Vec3& x : of.vertices) {
    if (box.contains(x)) inside_box.push_back(x);
  }
  if (inside_box.empty()) return;
  const SurfaceTree tree(in);
  std::vector<double> depths(inside_box.size());
  parallel_for_each_index(depths.size(), 64,
                          [&](std::size_t i) { depths[i] = -tree.signed_distance(inside_box[i]); });
  for (std::size_t i = 0; i < depths.size(); ++i) {
    if (depths[i] > overlap.depth) overlap = {depths[i], inside_box[i]};
  }
}

}  // namespace

SurfaceQuality measure_quality(const TriangleSurface& surface, double thin) {
  SurfaceQuality quality;
  quality.volume = volume(surface);
  quality.area = area(surface);
  quality.box = bounds(surface);
  // V - E + F = 2 - 2 genus, and every edge of a closed surface has two triangles.
  const auto vertices = static_cast<long>(surface.vertices.size());
  const auto triangles = static_cast<long>(surface.triangles.size());
  quality.genus = static_cast<int>(1 - (vertices - triangles / 2) / 2);
  quality.least_angle = quality.shortest_edge = std::numeric_limits<double>::infinity();
  for (const auto& [i, j, k] : surface.triangles) {
    const Vec3 &a = surface.vertices[i], &b = surface.vertices[j], &c = surface.vertices[k];
    if (const double angle = least_angle(a, b, c); angle < quality.least_angle) {
      quality.least_angle = angle;
      quality.least_angle_place = (a + b + c) / 3.0;
    }
    for (const double edge : {(a - b).norm(), (b - c).norm(), (c - a).norm()}) {
      quality.shortest_edge = std::min(quality.shortest_edge, edge);
      quality.longest_edge = std::max(quality.longest_edge, edge);
    }
  }

  const SurfaceTree tree(surface);
  const std::vector<Vec3> normals = vertex_normals(surface);
  const std::vector<double> areas = vertex_areas(surface);
  const double greatest = quality.box.sizes().norm();
  const double edge =
      std::sqrt(quality.area / (0.433 * static_cast<double>(surface.triangles.size())));
  const std::size_t stride = (surface.vertices.size() + kMostWalls - 1) / kMostWalls;
  std::vector<double> walls((surface.vertices.size() + stride - 1) / stride);
  parallel_for_each_index(walls.size(), 64, [&](std::size_t i) {
    const std::size_t v = i * stride;
    walls[i] =
        wall_at(surface, tree, surface.vertices[v], normals[v], greatest, edge).value_or(greatest);
  });
  double thinnest = greatest, thin_area = 0.0, measured = 0.0;
  for (std::size_t i = 0; i < walls.size(); ++i) {
    const std::size_t v = i * stride;
    measured += areas[v];
    if (walls[i] < thin) thin_area += areas[v];
    if (walls[i] < thinnest) thinnest = walls[i], quality.thinnest_place = surface.vertices[v];
  }
  if (thinnest < greatest) quality.thinnest_wall = thinnest;
  quality.thin_share = thin_area / measured;
  return quality;
}

Overlap greatest_overlap(const TriangleSurface& a, const TriangleSurface& b) {
  Overlap overlap;
  if (!bounds(a).intersects(bounds(b))) return overlap;
  deepest_of(a, b, overlap);
  deepest_of(b, a, overlap);
  return overlap;
}

}  // namespace viscera
