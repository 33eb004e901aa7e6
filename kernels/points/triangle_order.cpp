#include "kernels/points/triangle_order.h"

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

std::vector<std::size_t> triangles_along_curve(const TriangleSurface& surface) {
  Box box;
  for (const Vec3& vertex : surface.vertices) box.extend(vertex);
  const double scale = 1023.0 / std::max(1e-12, box.isEmpty() ? 0.0 : box.sizes().maxCoeff());
  std::vector<std::uint32_t> keys;
  keys.reserve(surface.triangles.size());
  for (const auto& [a, b, c] : surface.triangles) {
    const auto vertex = [&](int v) { return surface.vertices[static_cast<std::size_t>(v)]; };
    const Vec3 middle = (vertex(a) + vertex(b) + vertex(c)) / 3.0;
    const Vec3 cell = scale * (middle - box.min());
    keys.push_back(spread(static_cast<std::uint32_t>(cell.x())) |
                   spread(static_cast<std::uint32_t>(cell.y())) << 1 |
                   spread(static_cast<std::uint32_t>(cell.z())) << 2);
  }
  std::vector<std::size_t> order(keys.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::stable_sort(order, {}, [&](std::size_t i) { return keys[i]; });
  return order;
}

}  // namespace viscera
