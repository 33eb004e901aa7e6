#include "engine/features/touching/meeting_samples.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>

#include "kernels/base/parallel.h"

namespace viscera {
namespace {

/// Places of a circle that a patch's height is averaged over.
constexpr int kPlaces = 6;

Vec3 mean_normal(const TriangleSurface& surface, std::span<const Vec3f> normals,
                 const SurfacePoint& point) {
  Vec3 sum = Vec3::Zero();
  const std::array<int, 3>& corners = surface.triangles[static_cast<std::size_t>(point.triangle)];
  for (int c = 0; c < 3; ++c)
    sum += point.weights[c] *
           normals[static_cast<std::size_t>(corners[static_cast<std::size_t>(c)])].cast<double>();
  const double length = sum.norm();
  return length > 0.0 ? Vec3(sum / length) : Vec3::UnitZ();
}

/// Vertices chosen so far, by cells of a grid as wide as the widest pitch.
class Chosen {
 public:
  explicit Chosen(double edge) : edge_(edge) {}
  /// Index of the nearest within `radius`, which is at most the edge; -1: none.
  int nearest(const Vec3& x, double radius) const {
    const Cell middle = cell_of(x);
    int found = -1;
    double best = radius * radius;
    for (int dz = -1; dz <= 1; ++dz)
      for (int dy = -1; dy <= 1; ++dy)
        for (int dx = -1; dx <= 1; ++dx) {
          const auto at = cells_.find({middle[0] + dx, middle[1] + dy, middle[2] + dz});
          if (at == cells_.end()) continue;
          for (const auto& [place, index] : at->second)
            if (const double d = (place - x).squaredNorm(); d < best) {
              best = d;
              found = index;
            }
        }
    return found;
  }
  void add(const Vec3& x, int index) { cells_[cell_of(x)].emplace_back(x, index); }

 private:
  using Cell = std::array<int, 3>;
  Cell cell_of(const Vec3& x) const {
    Cell cell;
    for (int a = 0; a < 3; ++a)
      cell[static_cast<std::size_t>(a)] = static_cast<int>(std::floor(x[a] / edge_));
    return cell;
  }
  double edge_;
  std::map<Cell, std::vector<std::pair<Vec3, int>>> cells_;
};

}  // namespace

SurfacePatch patch_at(const SurfacePoint& point, double area, const TriangleSurface& surface,
                      std::span<const Vec3f> normals, const CollisionSurface& finder) {
  SurfacePatch patch{point, position(surface, point), mean_normal(surface, normals, point), area,
                     0.0};
  const double radius = std::sqrt(area / std::numbers::pi);
  // A disc's mean of the distance squared from its middle.
  const double ring = radius / std::numbers::sqrt2;
  const Vec3 first = patch.normal.unitOrthogonal(), second = patch.normal.cross(first);
  double sum = 0.0;
  int found = 0;
  for (int i = 0; i < kPlaces; ++i) {
    const double angle = 2.0 * std::numbers::pi * i / kPlaces;
    const Vec3 about = patch.position + ring * (std::cos(angle) * first + std::sin(angle) * second);
    const auto hit = finder.closest(about, radius);
    if (!hit) continue;
    sum += (hit->position - patch.position).dot(patch.normal);
    ++found;
  }
  if (found > 0) patch.height = sum / found;
  return patch;
}

std::vector<SurfacePatch> patches_of(const TriangleSurface& surface, std::span<const Vec3f> normals,
                                     const CollisionSurface& finder,
                                     const std::function<double(const Vec3&)>& pitch) {
  const std::size_t count = surface.vertices.size();
  std::vector<double> apart(count);
  double widest = 0.0;
  for (std::size_t v = 0; v < count; ++v)
    widest = std::max(widest, apart[v] = pitch(surface.vertices[v]));
  if (widest <= 0.0) return {};
  Chosen chosen(widest);
  std::vector<std::size_t> middles;
  std::vector<SurfacePoint> point_of(count);
  for (std::size_t t = 0; t < surface.triangles.size(); ++t)
    for (std::size_t c = 0; c < 3; ++c) {
      SurfacePoint& point = point_of[static_cast<std::size_t>(surface.triangles[t][c])];
      if (point.triangle < 0)
        point = {static_cast<int>(t), Vec3::Unit(static_cast<Eigen::Index>(c))};
    }
  for (std::size_t v = 0; v < count; ++v) {
    if (point_of[v].triangle < 0 || chosen.nearest(surface.vertices[v], apart[v]) >= 0) continue;
    chosen.add(surface.vertices[v], static_cast<int>(middles.size()));
    middles.push_back(v);
  }
  std::vector<double> areas(middles.size(), 0.0);
  const std::vector<double> of_vertices = vertex_areas(surface);
  for (std::size_t v = 0; v < count; ++v)
    if (const int owner = chosen.nearest(surface.vertices[v], widest); owner >= 0)
      areas[static_cast<std::size_t>(owner)] += of_vertices[v];
  std::vector<SurfacePatch> patches(middles.size());
  parallel_for_each_index(middles.size(), 64, [&](std::size_t i) {
    patches[i] = patch_at(point_of[middles[i]], areas[i], surface, normals, finder);
  });
  std::erase_if(patches, [](const SurfacePatch& patch) { return !(patch.area > 0.0); });
  return patches;
}

}  // namespace viscera
