#include "kernels/points/surface_scan.h"

#include <algorithm>
#include <cmath>

#include "kernels/points/closest_on_triangle.h"
#include "kernels/points/triangle_order.h"

namespace viscera {

SurfaceScan::SurfaceScan(const TriangleSurface& rest) : triangles_(triangles_along_curve(rest)) {
  std::vector<int> mine;
  for (std::size_t t = 0; t < triangles_.size(); ++t) {
    const auto& corners = rest.triangles[triangles_[t]];
    mine.insert(mine.end(), corners.begin(), corners.end());
    if ((t + 1) % kTriangles != 0 && t + 1 != triangles_.size()) continue;
    std::ranges::sort(mine);
    mine.erase(std::ranges::unique(mine).begin(), mine.end());
    begins_.push_back(static_cast<std::uint32_t>(vertices_.size()));
    vertices_.insert(vertices_.end(), mine.begin(), mine.end());
    mine.clear();
  }
  begins_.push_back(static_cast<std::uint32_t>(vertices_.size()));
}

std::optional<SurfaceScan::Found> SurfaceScan::closest(
    std::span<const std::array<int, 3>> triangles, std::span<const Vec3f> positions,
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
    for (std::size_t t = begin; t < std::min(begin + kTriangles, triangles_.size()); ++t) {
      const auto index = static_cast<int>(triangles_[t]);
      const auto corner = [&](std::size_t c) -> Vec3 {
        return positions[static_cast<std::size_t>(triangles[triangles_[t]][c])].cast<double>();
      };
      const Vec3 a = corner(0), b = corner(1), c = corner(2);
      const Vec3 weights = closest_weights(query, a, b, c);
      const double distance = (weights[0] * a + weights[1] * b + weights[2] * c - query).norm();
      if (distance < best.distance || (distance == best.distance && index < best.triangle))
        best = {index, weights, distance};
    }
  }
  if (best.triangle < 0) return std::nullopt;
  return best;
}

}  // namespace viscera
