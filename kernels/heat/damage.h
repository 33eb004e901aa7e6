// What heat has made of tissue, as three processes of their own: cells die of the dose of heat,
// proteins coagulate, collagen shrinks. Shares that pictures blend, and how its mechanics follow.
//
// Each keeps one number a voxel that grows with time at a rate that the temperature alone decides
// (bioheat_passes.cpp), so what matters is the history and not its steps. Of death it is the dose
// over the one that kills: 240 minutes at 43 C, half of that for every kelvin above, four times for
// every one below [Sapareto1984]. Of the others it is Omega, the time over the time that their
// Arrhenius law gives. Living tissue at rest stays sound: no law counts below the temperatures that
// it was made for (heat_parameters.h).
#pragma once

namespace viscera {

/// Shares 0 ... 1 of one place. Coagulated tissue is pale, seared tissue brown and dry, charred
/// black.
struct TissueState {
  double coagulated = 0.0;  ///< of its proteins
  double seared = 0.0;      ///< brown: dry, not yet char
  double charred = 0.0;
  double wetness = 1.0;  ///< of the surface's film
};

/// From Omega of coagulation, the water left and the solids that are char.
TissueState tissue_state(double coagulation, double water, double charred);

/// Share of the proteins that has coagulated. Liver's whitening begins some ten times sooner and
/// ends some ten times later than one rate says: as if each of a series of fractions had its own
/// [Jacques2006]; taken for all tissues. One rate's Omega says when half of it is done.
double coagulated_share(double coagulation);

/// Share of a length that collagen's shrinkage takes, from its Omega: a step, then for ever more
/// slowly with the logarithm of time [Chen1998]; fitted to porcine liver, 15 minutes at 60 to 95 C
/// [Rossmann2014], within 0.1 % of a length; taken for all tissues.
double collagen_shrinkage(double collagen);

/// How strongly it glows, over a body at 1000 K: Planck's radiation at 650 nm. Below about 800 K
/// nobody sees it, and it is 0.
double glow(double kelvin);

/// Young's modulus over that of sound tissue: sevenfold where it has coagulated, as a liver's shear
/// stiffness 1 cm from where it is ablated [A], and dried tissue four times that [R].
double stiffness_factor(const TissueState& state);

/// Length over that of sound tissue: collagen shrinks, and water that leaves takes half of its
/// volume along [R].
double remaining_length(const TissueState& state, double collagen, double water_fraction);

}  // namespace viscera
