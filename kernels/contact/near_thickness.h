// What is finer than the nodes where the tissue is thin over what holds it.
//
// A load that varies along the surface as cos(q x) moves that of a layer of thickness t on a rigid
// base L(q t) times as far as a half-space's: L grows from none, where the layer is thin against
// the load, to 1. It is known in closed form (tested against its equations). A band of loads meets
// the layer as tissue whose modulus is the mean of 1 over that of L, over the band's wave numbers
// as a disc of radius sigma has them: contacts as wide as that are whom a band matters to, narrower
// ones meet narrower bands. So it is one more factor of what near_modulus.h has for each place and
// width.
//
// Tissue whose other side is free bends, and that is wider than the near field: it is the nodes'.
#pragma once

#include <functional>

#include "kernels/contact/touchable_surface.h"
#include "kernels/paff/elasticity.h"
#include "kernels/points/surface_tree.h"

namespace viscera {

/// How far a layer of thickness t on a rigid base gives way under a load of wave number q, over the
/// half-space; x = q t > 0.
double layer_softness_pressed(double x, double poisson_ratio);
/// The same of loads that pull along the surface: of those along q and across it, as they share the
/// half-space's answer.
double layer_softness_pulled(double x, double poisson_ratio);

/// Modulus over the material's that loads as narrow as sigma, and no narrower than sigma / 2, meet
/// on a layer so many sigma thick. Thinner than a quarter counts as a quarter.
struct LayerModulus {
  double pressed = 1.0, pulled = 1.0;
};
LayerModulus layer_modulus(double thickness, double poisson_ratio);

/// Multiplies the surface's `modulus` by that, where below a place, along its normal, the body ends
/// held and faces away. Left empty where it is and no place is that thin. `spread` is sigma over
/// the spacing of nodes.
void note_thickness(TouchableSurface& surface, const IsotropicMaterial& material, double spread,
                    const TriangleSurface& body, const SurfaceTree& tree,
                    const std::function<bool(const Vec3&)>& is_fixed);

}  // namespace viscera
