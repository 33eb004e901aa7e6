#include "engine/render/triangle_clusters.h"

#include <algorithm>

#include "kernels/points/triangle_order.h"

namespace viscera {

TriangleClusters::TriangleClusters(const TriangleSurface& rest) {
  triangles_.reserve(rest.triangles.size());
  for (const std::size_t i : triangles_along_curve(rest)) triangles_.push_back(rest.triangles[i]);
  bounds_.resize(count());
}

std::span<const std::array<int, 3>> TriangleClusters::cluster(std::size_t index) const {
  const std::size_t first = index * kTriangles;
  return std::span(triangles_).subspan(first, std::min(kTriangles, triangles_.size() - first));
}

void TriangleClusters::fit(std::span<const Vec3f> positions) {
  for (std::size_t i = 0; i < count(); ++i) {
    Eigen::AlignedBox3f box;
    for (const auto& triangle : cluster(i))
      for (const int vertex : triangle) box.extend(positions[static_cast<std::size_t>(vertex)]);
    bounds_[i] = box.cast<double>();
  }
}

}  // namespace viscera
