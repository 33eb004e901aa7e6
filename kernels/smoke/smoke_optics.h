// How smoke meets light.
#pragma once

namespace viscera {

/// Of the smoke itself, for light in the visible: by Mie's series (droplet_optics.h) from what
/// assets/smoke.json says of its droplets.
struct SmokeOptics {
  double mass_extinction = 5390.0;  ///< [m2/kg]
  double albedo = 0.895;            ///< scattered share of what is taken from a ray
  double asymmetry = 0.667;         ///< g of [Henyey1941]
};

}  // namespace viscera
