// Simple bodies with nodes in them, for problems with known answers.
#pragma once

#include <functional>
#include <vector>

#include "kernels/contact/cell_pattern.h"
#include "kernels/contact/patch_contact.h"
#include "kernels/paff/elasticity.h"

namespace viscera {

/// A closed surface with nodes in it; its ElasticProblem points into it.
struct NodedBody {
  TriangleSurface surface;
  PointCloud cloud;

  ElasticProblem problem(const IsotropicMaterial& material,
                         std::function<bool(const Vec3&)> is_fixed) const {
    return {&surface, &cloud, material, std::move(is_fixed)};
  }
};

/// Axis-aligned unit cube about the origin, each face split into divisions x divisions squares of
/// two triangles.
TriangleSurface unit_cube(int divisions);

/// The unit cube about the origin with (cells + 1)^3 nodes; interior coordinates are moved by up to
/// `jitter` cells, nodes on faces stay on them. The same draw of numbers for every call.
NodedBody jittered_cube(int cells, double jitter);

/// Half a ball above z = 0, the pole up, closed by its flat base. The dome has `rings` rings about
/// the pole, equally far apart, and the base as many: 12 rings^2 triangles. Vertices of the dome
/// lie on the sphere.
TriangleSurface ringed_hemisphere(double radius, int rings);

/// A box between the first and the last of these lines, its faces split along them into two
/// triangles a rectangle. Lines ascend.
TriangleSurface lined_box(const std::vector<double>& x, const std::vector<double>& y,
                          const std::vector<double>& z);

/// A closed surface turned about the z axis from (distance from the axis, z) places, the first and
/// the last on the axis, the first the uppermost. Triangles are about as wide as the places of the
/// outline are apart.
TriangleSurface turned_surface(const std::vector<Vec2>& outline);

/// A pattern laid on a ball about the origin around its pole, areas kept. Outward normals; the tool
/// is for the caller to fill in.
std::vector<ContactCell> cap_cells(double radius, const CellPattern& pattern);

/// Relative L2 error over the nodes of a body whose nodal unknowns (3 N) are these; NaN where a
/// node isn't covered.
double nodal_error(const std::function<Vec3(const Vec3&)>& exact, const Formulation& formulation,
                   const PointCloud& cloud, const std::vector<double>& unknowns);

}  // namespace viscera
