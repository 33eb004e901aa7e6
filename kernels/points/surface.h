// A triangle surface and its elementary geometry.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "kernels/base/fields.h"
#include "kernels/base/types.h"

namespace viscera {

/// Triangles over shared vertices. Outward orientation: counter-clockwise seen from outside.
struct TriangleSurface {
  std::vector<Vec3> vertices;                 ///< [m]
  std::vector<std::array<int, 3>> triangles;  ///< indices into vertices

  bool empty() const { return triangles.empty(); }
  static constexpr auto fields() {
    return std::tuple(field("vertices", &TriangleSurface::vertices),
                      field("triangles", &TriangleSurface::triangles));
  }
};
static_assert(fields_cover<TriangleSurface>());

/// A place on a surface: triangle and barycentric weights of its three corners.
struct SurfacePoint {
  int triangle = -1;
  Vec3 weights = Vec3::Zero();
  static constexpr auto fields() {
    return std::tuple(field("triangle", &SurfacePoint::triangle),
                      field("weights", &SurfacePoint::weights));
  }
};
static_assert(fields_cover<SurfacePoint>());

Box bounds(const TriangleSurface& surface);
/// Area vector of one triangle: outward normal times area [m2].
Vec3 area_vector(const TriangleSurface& surface, int triangle);
double area(const TriangleSurface& surface);
/// Enclosed volume [m3] by the divergence theorem; negative when the surface is inside-out.
double volume(const TriangleSurface& surface);
/// Angle-weighted unit normals at the vertices.
std::vector<Vec3> vertex_normals(const TriangleSurface& surface);
/// A third of the area of the triangles around each vertex [m2].
std::vector<double> vertex_areas(const TriangleSurface& surface);
Vec3 position(const TriangleSurface& surface, const SurfacePoint& point);
/// Without vertices that no triangle has; numbered as the triangles come to them.
TriangleSurface with_used_vertices(const TriangleSurface& surface);

}  // namespace viscera
