// Prepared bodies and tool cells for tests of contact.
#pragma once

#include <functional>
#include <memory>
#include <vector>

#include "kernels/contact/deformation.h"
#include "kernels/contact/patch_contact.h"
#include "kernels/points/node_placement.h"

namespace viscera::test {

/// A body ready for contact on part of its surface.
struct PressedBody {
  TriangleSurface surface;
  PointCloud cloud;
  IsotropicMaterial material;
  std::unique_ptr<ShapeFunctions> fields;
  SurfacePlaces places;
  TouchableSurface touch;
  SurfaceCompliance compliance;
  DrawnSurface drawn;  ///< of `surface`, where asked for; point drawn.rest at it before use
  bool ready = false;  ///< false: a step of preparation failed, and a test failure says which
};

/// Places nodes, prepares the body with the galerkin formulation and asks for the compliance of the
/// touchable part against the whole surface; with `drawn`, lets that carry it. Touchable places
/// have the modulus of what lies beneath them, as organs note it.
PressedBody prepare_body(TriangleSurface surface, const IsotropicMaterial& material,
                         const SpacingField& spacing,
                         const std::function<bool(const Vec3&)>& is_fixed,
                         const std::function<bool(const Vec3&)>& is_touchable, bool drawn = false,
                         const std::function<double(const Vec3&, double)>& relative_modulus = {});

/// A block of these edges [m] centred at the origin, held at its bottom, touchable on its top
/// within `reach` of the axis in x and y.
PressedBody prepare_block(const Vec3& edges, double spacing, double reach,
                          const IsotropicMaterial& material);

/// What most tests of contact press: a block of 40 x 40 x 24 mm on its bottom with nodes 4 mm
/// apart, touchable within 16 mm of its axis, prepared once; not `ready` where that failed.
inline const IsotropicMaterial kTissue{1e4, 0.45};
inline constexpr double kTop = 0.012;  ///< height of its top [m]
const PressedBody& block();

/// Hexagonal grid of cells `pitch` apart about `centre` on the plane z = centre.z, pressed straight
/// down by a ball of this radius whose lowest point is `depth` below that plane (radius 0: a flat
/// punch). 1 + 3 rings (rings + 1) cells.
std::vector<ContactCell> plane_cells(const Vec3& centre, double pitch, int rings, double radius,
                                     double depth);

Vec3 total_force(const ContactSolution& solution);

}  // namespace viscera::test
