#include "engine/render/triangle_clusters.h"

#include <algorithm>
#include <cstdint>
#include <numeric>

namespace viscera {
namespace {

/// The lowest ten bits, two zeros after each.
std::uint32_t spread(std::uint32_t x) {
  x &= 0x3ff;
  x = (x | (x << 16)) & 0x030000ff;
  x = (x | (x << 8)) & 0x0300f00f;
  x = (x | (x << 4)) & 0x030c30c3;
  return (x | (x << 2)) & 0x09249249;
}

}  // namespace

TriangleClusters::TriangleClusters(const TriangleSurface& rest) {
  Box box;
  for (const Vec3& vertex : rest.vertices) box.extend(vertex);
  const double scale = 1023.0 / std::max(1e-12, box.isEmpty() ? 0.0 : box.sizes().maxCoeff());
  std::vector<std::uint32_t> keys;
  keys.reserve(rest.triangles.size());
  for (const auto& [a, b, c] : rest.triangles) {
    const auto vertex = [&](int v) { return rest.vertices[static_cast<std::size_t>(v)]; };
    const Vec3 middle = (vertex(a) + vertex(b) + vertex(c)) / 3.0;
    const Vec3 cell = scale * (middle - box.min());
    keys.push_back(spread(static_cast<std::uint32_t>(cell.x())) |
                   spread(static_cast<std::uint32_t>(cell.y())) << 1 |
                   spread(static_cast<std::uint32_t>(cell.z())) << 2);
  }
  std::vector<std::size_t> order(keys.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::stable_sort(order, {}, [&](std::size_t i) { return keys[i]; });
  triangles_.reserve(order.size());
  for (const std::size_t i : order) triangles_.push_back(rest.triangles[i]);
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
