// What heat has made of tissue: shares that pictures blend, and how its mechanics follow.
#pragma once

namespace viscera {

/// Shares 0 ... 1 of one place. Coagulated tissue is pale, seared tissue brown and dry, charred
/// black.
struct TissueState {
  double coagulated = 0.0;  ///< of its proteins: 1 - exp(-Omega)
  double seared = 0.0;      ///< brown: dry, not yet char
  double charred = 0.0;
  double wetness = 1.0;  ///< of the surface's film
};

/// From Omega, the water left and the solids that are char.
TissueState tissue_state(double damage, double water, double charred);

/// How strongly it glows, over a body at 1000 K: Planck's radiation at 650 nm. Below about 800 K
/// nobody sees it, and it is 0.
double glow(double kelvin);

/// Young's modulus over that of sound tissue. Coagulated liver is several times as stiff; dried
/// tissue more so. [R]
double stiffness_factor(const TissueState& state);

/// Length over that of sound tissue: collagen shrinks as it coagulates, and water that leaves takes
/// its volume along. [R]
double shrinkage(const TissueState& state, double water_fraction);

}  // namespace viscera
