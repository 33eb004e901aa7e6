#include "engine/io/mesh_export.h"

#include <fmt/format.h>

#include <cstdio>
#include <iterator>

namespace viscera {

std::string obj_text(const TriangleSurface& surface, const std::string& about) {
  std::string text = std::string(kObjMark) + "; unit: mm\n";
  for (std::size_t at = 0; at < about.size();) {
    const std::size_t end = std::min(about.find('\n', at), about.size());
    text += "# " + about.substr(at, end - at) + '\n';
    at = end + 1;
  }
  const auto out = std::back_inserter(text);
  for (const Vec3& x : surface.vertices) {
    fmt::format_to(out, "v {:.4f} {:.4f} {:.4f}\n", 1e3 * x.x(), 1e3 * x.y(), 1e3 * x.z());
  }
  for (const auto& [a, b, c] : surface.triangles) {
    fmt::format_to(out, "f {} {} {}\n", a + 1, b + 1, c + 1);
  }
  return text;
}

std::string nodes_ply_text(const PointCloud& cloud) {
  std::string text = fmt::format(
      "ply\nformat ascii 1.0\ncomment nodes of an organ, in millimetres\nelement vertex {}\n"
      "property float x\nproperty float y\nproperty float z\nproperty float spacing\n"
      "property uchar surface\nend_header\n",
      cloud.size());
  const auto out = std::back_inserter(text);
  for (std::size_t n = 0; n < cloud.size(); ++n) {
    const Vec3 x = 1e3 * cloud.positions[n];
    fmt::format_to(out, "{:.4f} {:.4f} {:.4f} {:.4f} {}\n", x.x(), x.y(), x.z(),
                   1e3 * cloud.spacings[n], n < cloud.surface_count ? 1 : 0);
  }
  return text;
}

}  // namespace viscera
