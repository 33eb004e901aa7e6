// Quadrature over a triangle surface: triangles split to the node spacing, three or six points
// each.
#pragma once

#include <cstddef>
#include <functional>
#include <vector>

#include "kernels/paff/local_spacing.h"
#include "kernels/points/surface.h"

namespace viscera {

/// Points on the surface, exact on each triangle for integrands of the asked degree. Tractions,
/// held displacements and the integration constraint all use these same points: a linear field
/// comes out exact only where the divergence theorem and the loads are summed alike [Chen2013].
struct SurfaceQuadrature {
  std::vector<Vec3> positions;  ///< [m]
  std::vector<Vec3> normals;    ///< outward, unit
  std::vector<double> weights;  ///< [m2]
  std::vector<char> fixed;      ///< 1 where the body is held

  std::size_t size() const { return positions.size(); }
};

/// Triangles no longer than h, with three points for degree 2 and six for degree 4 [Dunavant1985].
/// Triangles of no area carry no points. `is_fixed` may be empty: nothing is held then.
SurfaceQuadrature surface_quadrature(const TriangleSurface& surface, const LocalSpacing& spacing,
                                     const std::function<bool(const Vec3&)>& is_fixed,
                                     int degree = 2);

}  // namespace viscera
