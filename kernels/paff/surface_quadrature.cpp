#include "kernels/paff/surface_quadrature.h"

namespace viscera {
namespace {

using Corners = std::array<Vec3, 3>;

/// Halves the longest edge until it is no longer than the local spacing, and appends three points
/// for each part. The parts of one triangle share its normal.
void add_triangle(const Corners& corners, const LocalSpacing& spacing, SurfaceQuadrature& out) {
  int longest = 0;
  double length2 = 0.0;
  for (int i = 0; i < 3; ++i) {
    const double edge2 = (corners[(i + 1) % 3] - corners[i]).squaredNorm();
    if (edge2 > length2) {
      length2 = edge2;
      longest = i;
    }
  }
  const Vec3 centre = (corners[0] + corners[1] + corners[2]) / 3.0;
  const double h = spacing(centre);
  if (length2 > h * h) {
    const Vec3& a = corners[longest];
    const Vec3& b = corners[(longest + 1) % 3];
    const Vec3& c = corners[(longest + 2) % 3];
    const Vec3 middle = 0.5 * (a + b);
    add_triangle({a, middle, c}, spacing, out);
    add_triangle({middle, b, c}, spacing, out);
    return;
  }
  const Vec3 area_vector = 0.5 * (corners[1] - corners[0]).cross(corners[2] - corners[0]);
  const double area = area_vector.norm();
  if (!(area > 0.0)) return;
  for (int i = 0; i < 3; ++i) {
    out.positions.push_back(0.5 * (centre + corners[i]));  // barycentric (2/3, 1/6, 1/6)
    out.normals.push_back(area_vector / area);
    out.weights.push_back(area / 3.0);
  }
}

}  // namespace

SurfaceQuadrature surface_quadrature(const TriangleSurface& surface, const LocalSpacing& spacing,
                                     const std::function<bool(const Vec3&)>& is_fixed) {
  SurfaceQuadrature out;
  for (const std::array<int, 3>& triangle : surface.triangles) {
    const auto corner = [&](int i) {
      return surface.vertices[static_cast<std::size_t>(triangle[static_cast<std::size_t>(i)])];
    };
    add_triangle({corner(0), corner(1), corner(2)}, spacing, out);
  }
  out.fixed.resize(out.size(), 0);
  if (is_fixed) {
    for (std::size_t b = 0; b < out.size(); ++b) out.fixed[b] = is_fixed(out.positions[b]) ? 1 : 0;
  }
  return out;
}

}  // namespace viscera
