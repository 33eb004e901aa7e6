#include "kernels/paff/surface_quadrature.h"

#include <span>

namespace viscera {
namespace {

using Corners = std::array<Vec3, 3>;

/// Three points of equal weight at barycentric coordinates (1 - 2 share, share, share).
struct Orbit {
  double share;
  double weight;  ///< of each, over the triangle's area
};

constexpr Orbit kDegree2[] = {{1.0 / 6.0, 1.0 / 3.0}};
// [Dunavant1985], the rule of six points.
constexpr Orbit kDegree4[] = {{0.44594849091596488632, 0.22338158967801146570},
                              {0.09157621350977074346, 0.10995174365532186764}};

/// Halves the longest edge until it is no longer than the local spacing, and appends the points of
/// each part. The parts of one triangle share its normal.
void add_triangle(const Corners& corners, const LocalSpacing& spacing,
                  std::span<const Orbit> orbits, SurfaceQuadrature& out) {
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
    add_triangle({a, middle, c}, spacing, orbits, out);
    add_triangle({middle, b, c}, spacing, orbits, out);
    return;
  }
  const Vec3 area_vector = 0.5 * (corners[1] - corners[0]).cross(corners[2] - corners[0]);
  const double area = area_vector.norm();
  if (!(area > 0.0)) return;
  for (const Orbit& orbit : orbits) {
    for (int i = 0; i < 3; ++i) {
      out.positions.push_back(centre + (1.0 - 3.0 * orbit.share) * (corners[i] - centre));
      out.normals.push_back(area_vector / area);
      out.weights.push_back(orbit.weight * area);
    }
  }
}

}  // namespace

SurfaceQuadrature surface_quadrature(const TriangleSurface& surface, const LocalSpacing& spacing,
                                     const std::function<bool(const Vec3&)>& is_fixed, int degree) {
  const std::span<const Orbit> orbits =
      degree <= 2 ? std::span<const Orbit>(kDegree2) : std::span<const Orbit>(kDegree4);
  SurfaceQuadrature out;
  for (const std::array<int, 3>& triangle : surface.triangles) {
    const auto corner = [&](int i) {
      return surface.vertices[static_cast<std::size_t>(triangle[static_cast<std::size_t>(i)])];
    };
    add_triangle({corner(0), corner(1), corner(2)}, spacing, orbits, out);
  }
  out.fixed.resize(out.size(), 0);
  if (is_fixed) {
    for (std::size_t b = 0; b < out.size(); ++b) out.fixed[b] = is_fixed(out.positions[b]) ? 1 : 0;
  }
  return out;
}

}  // namespace viscera
