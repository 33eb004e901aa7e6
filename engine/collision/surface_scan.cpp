#include "engine/collision/surface_scan.h"

#include <algorithm>
#include <cmath>

#include "kernels/points/closest_on_triangle.h"
#include "kernels/points/triangle_order.h"

namespace viscera {

SurfaceScan::SurfaceScan(const TriangleSurface& rest) {
  for (const std::size_t t : triangles_along_curve(rest)) {
    triangles_.push_back(static_cast<int>(t));
    corners_.push_back(rest.triangles[t]);
  }
  std::vector<int> mine;
  for (std::size_t t = 0; t < corners_.size(); ++t) {
    mine.insert(mine.end(), corners_[t].begin(), corners_[t].end());
    if ((t + 1) % kTriangles != 0 && t + 1 != corners_.size()) continue;
    std::ranges::sort(mine);
    mine.erase(std::ranges::unique(mine).begin(), mine.end());
    begins_.push_back(static_cast<std::uint32_t>(vertices_.size()));
    vertices_.insert(vertices_.end(), mine.begin(), mine.end());
    mine.clear();
  }
  begins_.push_back(static_cast<std::uint32_t>(vertices_.size()));
}

std::optional<SurfaceScan::Found> SurfaceScan::closest(std::span<const Vec3f> positions,
                                                       const Vec3& query, double radius) const {
  struct Group {
    float distance;
    std::size_t index;
  };
  const Vec3f from = query.cast<float>();
  // Rounding of the boxes and of the query to single precision.
  const double margin = 1e-5 * (radius + query.norm());
  std::vector<Group> groups;
  for (std::size_t g = 0; g + 1 < begins_.size(); ++g) {
    Vec3f low = positions[static_cast<std::size_t>(vertices_[begins_[g]])], high = low;
    for (std::uint32_t i = begins_[g] + 1; i < begins_[g + 1]; ++i) {
      const Vec3f& vertex = positions[static_cast<std::size_t>(vertices_[i])];
      low = low.cwiseMin(vertex);
      high = high.cwiseMax(vertex);
    }
    const float distance = (low - from).cwiseMax(from - high).cwiseMax(0.0f).norm();
    if (distance <= radius + margin) groups.push_back({distance, g});
  }
  std::ranges::sort(groups, {}, &Group::distance);
  Found best{-1, Vec3::Zero(), radius};
  for (const Group& group : groups) {
    if (group.distance > best.distance + margin) break;
    const std::size_t begin = group.index * kTriangles;
    for (std::size_t t = begin; t < std::min(begin + kTriangles, corners_.size()); ++t) {
      const auto corner = [&](std::size_t c) -> Vec3 {
        return positions[static_cast<std::size_t>(corners_[t][c])].cast<double>();
      };
      const Vec3 a = corner(0), b = corner(1), c = corner(2);
      const Vec3 weights = closest_weights(query, a, b, c);
      const double distance = (weights[0] * a + weights[1] * b + weights[2] * c - query).norm();
      if (distance < best.distance || (distance == best.distance && triangles_[t] < best.triangle))
        best = {triangles_[t], weights, distance};
    }
  }
  if (best.triangle < 0) return std::nullopt;
  return best;
}

}  // namespace viscera
