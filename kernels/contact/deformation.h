// From contact forces to the drawn surface: u = C_un f, carried by the shape functions, with the
// near field of the contacts added, and fresh normals. [De2006] section 3.1.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "kernels/contact/contact_cells.h"
#include "kernels/contact/sides_of_places.h"
#include "kernels/contact/surface_places.h"
#include "kernels/paff/elasticity.h"

namespace viscera {

/// Displacements of the places of a surface under the loads [m], 3 x places. Reads only the columns
/// of touched places; single precision.
void place_displacements(const SurfaceCompliance& compliance, const ContactResponse& response,
                         std::vector<float>& displacements);

/// Rest data of the drawn surface that never changes.
struct DrawnSurface {
  const TriangleSurface* rest = nullptr;
  SparseWeights carriers;  ///< what each vertex takes of the places about it; columns are places,
                           ///< rows sum up to 1                          (V rows)
  std::vector<int> triangle_begin, triangle_items;  ///< vertex -> triangles around it
  std::vector<Vec3> rest_normals;  ///< unit; which side of a thin body a vertex is on     (V)
  std::shared_ptr<const SidesOfPlaces> sides;  ///< null: the body has no folds
};

/// Carriers of every vertex: the smoothest interpolation of the places about it that face its way.
/// Linear fields are carried exactly, smooth ones with an error of second order in h. `surface`
/// outlives the result; `places` are of it or of a coarser picture of it.
DrawnSurface carry_surface(const TriangleSurface& surface, const SurfacePlaces& places);

/// The same without carriers: of a surface that is moved otherwise, for its normals.
DrawnSurface carried_by_none(const TriangleSurface& surface);

/// What the displacements of the places make of those of the drawn vertices [m]. Parallel,
/// deterministic.
void carry_displacements(const DrawnSurface& drawn, std::span<const float> displacements,
                         std::vector<Vec3f>& vertices);

/// Positions = rest + carried displacements of the places + near field of `cells` under `forces`
/// (within its range). `near_fields` has one entry a cell (ContactSolution::near_fields) or is
/// empty: no near field. Parallel, deterministic.
void deformed_positions(const DrawnSurface& drawn, std::span<const float> displacements,
                        std::span<const NearField> near_fields, std::span<const ContactCell> cells,
                        std::span<const Vec3> forces, std::vector<Vec3f>& positions);

/// The same with unit normals from the deformed triangles, angle-weighted.
void deform_drawn_surface(const DrawnSurface& drawn, std::span<const float> displacements,
                          std::span<const NearField> near_fields,
                          std::span<const ContactCell> cells, std::span<const Vec3> forces,
                          std::vector<Vec3f>& positions, std::vector<Vec3f>& normals);

/// The unit normals that deform_drawn_surface gives to these positions: of one vertex, of all.
Vec3f deformed_normal(const DrawnSurface& drawn, std::span<const Vec3f> positions,
                      std::size_t vertex);
void deformed_normals(const DrawnSurface& drawn, std::span<const Vec3f> positions,
                      std::vector<Vec3f>& normals);

/// What deform_drawn_surface adds to the carried displacements, where it isn't zero: `vertices`
/// ascending, their near field [m]. For a surface that is carried elsewhere, as on a GPU: the near
/// field's closed forms concern the few vertices about a tip. Parallel, deterministic.
void near_field_on_surface(const DrawnSurface& drawn, std::span<const NearField> near_fields,
                           std::span<const ContactCell> cells, std::span<const Vec3> forces,
                           std::vector<int>& vertices, std::vector<Vec3f>& displacements);

}  // namespace viscera
