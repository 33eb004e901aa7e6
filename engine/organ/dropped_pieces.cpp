#include "engine/organ/dropped_pieces.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "kernels/base/parallel.h"
#include "kernels/paff/nodal_measures.h"
#include "kernels/points/closed_pieces.h"

namespace viscera {
namespace {

/// How many of these places lie within a closed piece of a surface.
std::size_t count_within(std::span<const Vec3> places, const TriangleSurface& piece) {
  if (places.empty()) return 0;
  const TriangleSurface alone = with_used_vertices(piece);
  const Box box = bounds(alone);
  const auto may_have = [&](const Vec3& place) { return box.contains(place); };
  if (std::ranges::none_of(places, may_have)) return 0;
  const SurfaceTree tree(alone);
  return static_cast<std::size_t>(std::ranges::count_if(places, [&](const Vec3& place) {
    return may_have(place) && tree.signed_distance(place) < 0.0;
  }));
}

/// Of a node's volume over the cube of its spacing: less is rounding.
constexpr double kNothing = 1e-12;

PointCloud chosen_of(const PointCloud& cloud, const std::vector<char>& chosen) {
  PointCloud some;
  for (std::size_t n = 0; n < cloud.size(); ++n) {
    if (!chosen[n]) continue;
    if (n < cloud.surface_count) ++some.surface_count;
    some.positions.push_back(cloud.positions[n]);
    some.spacings.push_back(cloud.spacings[n]);
  }
  return some;
}

}  // namespace

Dropped drop_pieces(double least, std::span<const Vec3> removed, CarvedSurface& left) {
  const std::vector<TriangleSurface> pieces = closed_pieces(left.surface);
  if (pieces.size() < 2) return {};
  Dropped dropped;
  std::vector<char> kept(left.surface.vertices.size(), 0);
  for (const TriangleSurface& piece : pieces) {
    const double size = volume(piece);
    const std::size_t within = count_within(removed, piece);
    const bool out = within > 0;
    dropped.found += within;
    if (out || size < least) {
      (out ? dropped.removed : dropped.crumbs) += size;
      Box& box = dropped.boxes.emplace_back();
      for (const std::array<int, 3>& triangle : piece.triangles)
        for (const int corner : triangle)
          box.extend(piece.vertices[static_cast<std::size_t>(corner)]);
      continue;
    }
    for (const std::array<int, 3>& triangle : piece.triangles)
      for (const int corner : triangle) kept[static_cast<std::size_t>(corner)] = 1;
  }
  CarvedSurface whole = std::exchange(left, {});
  left.surface.vertices = std::move(whole.surface.vertices);
  for (std::size_t t = 0; t < whole.skin.size(); ++t) {
    if (!kept[static_cast<std::size_t>(whole.surface.triangles[t][0])]) continue;
    left.surface.triangles.push_back(whole.surface.triangles[t]);
    left.skin.push_back(whole.skin[t]);
  }
  left.surface = with_used_vertices(left.surface);
  return dropped;
}

PointCloud nodes_about(const SurfaceTree& surface, const PointCloud& cloud, double far) {
  std::vector<char> carries(cloud.size());
  parallel_for_each_index(cloud.size(), 64, [&](std::size_t n) {
    carries[n] = surface.signed_distance(cloud.positions[n]) < far * cloud.spacings[n];
  });
  return chosen_of(cloud, carries);
}

PointCloud nodes_that_carry(const TriangleSurface& surface, const PointCloud& cloud,
                            const ShapeFunctions& fields) {
  const auto volumes = nodal_volumes(surface, cloud, fields);
  if (!volumes) return cloud;
  std::vector<char> carries(cloud.size());
  for (std::size_t n = 0; n < cloud.size(); ++n)
    carries[n] = std::abs((*volumes)[n]) > kNothing * std::pow(cloud.spacings[n], 3);
  return chosen_of(cloud, carries);
}

}  // namespace viscera
