// From contact forces to the drawn surface: u = C_un f, carried by the shape functions, with the
// near field of the contacts added, and fresh normals. [De2006] section 3.1.
#pragma once

#include <span>
#include <vector>

#include "kernels/contact/patch_contact.h"

namespace viscera {

/// Unknowns of the visible nodes under the loads [m], 3 x visible, node-major. Reads only the
/// columns of touched nodes; single precision.
void displacement_unknowns(const SurfaceCompliance& compliance, const ContactResponse& response,
                           std::vector<float>& unknowns);

/// Rest data of the drawn surface that never changes.
struct DrawnSurface {
  const TriangleSurface* rest = nullptr;
  SparseWeights carriers;  ///< phi_J at each vertex; columns are indices into
                           ///< SurfaceCompliance::visible                (V rows)
  std::vector<int> triangle_begin, triangle_items;  ///< vertex -> triangles around it
  std::vector<Vec3> rest_normals;  ///< unit; which side of a thin body a vertex is on     (V)
};

/// Carriers of every vertex. `visible_nodes` (in: nodes wanted anyway, the touchable ones; out:
/// those and all whose fields reach a vertex, ascending) is what to ask of the compliance.
/// `surface` outlives the result. Fails where the fields don't cover a vertex.
Result<DrawnSurface> carry_surface(const TriangleSurface& surface, const ShapeFunctions& fields,
                                   std::vector<int>& visible_nodes);

/// Positions = rest + sum phi_J alpha_J + near field of `cells` under `forces` (within its range);
/// unit normals from the deformed triangles, angle-weighted. `near_fields` has one entry a cell
/// (ContactSolution::near_fields) or is empty: no near field. Parallel, deterministic.
void deform_drawn_surface(const DrawnSurface& drawn, std::span<const float> unknowns,
                          std::span<const NearField> near_fields,
                          std::span<const ContactCell> cells, std::span<const Vec3> forces,
                          std::vector<Vec3f>& positions, std::vector<Vec3f>& normals);

}  // namespace viscera
