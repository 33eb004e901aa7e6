#include "engine/organ/shaded_view.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "engine/io/base64.h"

namespace viscera {
namespace {

void put(std::string& bytes, std::uint32_t value, int size) {
  for (int b = 0; b < size; ++b) bytes += static_cast<char>(value >> 8 * b & 255u);
}

}  // namespace

std::vector<std::uint8_t> shaded_view(const TriangleSurface& surface, const Vec3& right,
                                      const Vec3& up, int pixels) {
  const Vec3 towards = right.cross(up);  // to the viewer
  const Box box = bounds(surface);
  const Vec3 centre = box.center();
  double reach = 0.0;
  for (const Vec3& x : surface.vertices) {
    reach = std::max({reach, std::abs((x - centre).dot(right)), std::abs((x - centre).dot(up))});
  }
  const double scale = 0.47 * pixels / std::max(reach, 1e-9);
  std::vector<std::uint8_t> grey(static_cast<std::size_t>(pixels) * pixels, 255);
  std::vector<double> depth(grey.size(), -std::numeric_limits<double>::infinity());
  for (int t = 0; t < static_cast<int>(surface.triangles.size()); ++t) {
    const double facing = area_vector(surface, t).normalized().dot(towards);
    if (!(facing > 0.0)) continue;
    const auto shade = static_cast<std::uint8_t>(std::lround(50.0 + 180.0 * facing));
    std::array<Vec3, 3> corner;  // pixels and depth
    for (int c = 0; c < 3; ++c) {
      const Vec3 x = surface.vertices[surface.triangles[t][c]] - centre;
      corner[c] = {0.5 * pixels + scale * x.dot(right), 0.5 * pixels - scale * x.dot(up),
                   x.dot(towards)};
    }
    const auto [left, far_right] = std::minmax({corner[0].x(), corner[1].x(), corner[2].x()});
    const auto [top, bottom] = std::minmax({corner[0].y(), corner[1].y(), corner[2].y()});
    const Vec2 a = corner[0].head<2>(), b = corner[1].head<2>(), c = corner[2].head<2>();
    const double whole = (b - a).x() * (c - a).y() - (b - a).y() * (c - a).x();
    if (whole == 0.0) continue;
    for (int row = std::max(0, int(top)); row <= std::min(pixels - 1, int(bottom)); ++row) {
      for (int column = std::max(0, int(left)); column <= std::min(pixels - 1, int(far_right));
           ++column) {
        const Vec2 p(column + 0.5, row + 0.5);
        const auto side = [&p](const Vec2& from, const Vec2& to) {
          return (to - from).x() * (p - from).y() - (to - from).y() * (p - from).x();
        };
        const double u = side(b, c) / whole, v = side(c, a) / whole, w = 1.0 - u - v;
        if (u < 0.0 || v < 0.0 || w < 0.0) continue;
        const double z = u * corner[0].z() + v * corner[1].z() + w * corner[2].z();
        const std::size_t pixel = static_cast<std::size_t>(row) * pixels + column;
        if (z <= depth[pixel]) continue;
        depth[pixel] = z;
        grey[pixel] = shade;
      }
    }
  }
  return grey;
}

std::string data_uri(const std::vector<std::uint8_t>& grey, int pixels) {
  // Windows bitmap with a palette of 256 greys; rows from the bottom, padded to four bytes.
  const std::uint32_t row = (static_cast<std::uint32_t>(pixels) + 3u) / 4u * 4u;
  const std::uint32_t offset = 14 + 40 + 4 * 256, size = offset + row * pixels;
  std::string bytes = "BM";
  for (const std::uint32_t value : {size, 0u, offset, 40u}) put(bytes, value, 4);
  put(bytes, pixels, 4);
  put(bytes, pixels, 4);
  put(bytes, 1, 2);
  put(bytes, 8, 2);
  for (const std::uint32_t value : {0u, row * pixels, 2835u, 2835u, 256u, 0u}) {
    put(bytes, value, 4);
  }
  for (std::uint32_t shade = 0; shade < 256; ++shade) put(bytes, shade * 0x10101u, 4);
  for (int y = pixels - 1; y >= 0; --y) {
    bytes.append(reinterpret_cast<const char*>(grey.data()) + static_cast<std::size_t>(y) * pixels,
                 pixels);
    bytes.append(row - pixels, '\0');
  }
  return "data:image/bmp;base64," + base64(bytes);
}

}  // namespace viscera
