// How smoke meets light.
#pragma once

namespace viscera {

/// Of the smoke itself, for light in the visible. assets/smoke.json holds the values with their
/// sources.
struct SmokeOptics {
  double mass_extinction = 4000.0;  ///< [m2/kg]
  double albedo = 0.9;              ///< scattered share of what is taken from a ray
  double asymmetry = 0.65;          ///< g of [Henyey1941]
};

}  // namespace viscera
