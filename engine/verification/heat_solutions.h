// Problems of heat with answers in closed form [Carslaw1959], and bodies to pose them on.
#pragma once

#include <functional>

#include "kernels/heat/bioheat.h"

namespace viscera {

/// Tissue whose values don't change and that nothing carries heat away from: what closed forms
/// know.
ThermalTissue plain_tissue();

/// Diffusivity of wet tissue [m2/s].
double diffusivity(const ThermalTissue& tissue);

/// `energy` [J] put into an infinite medium at t = 0 as a Gaussian of standard deviation `width`:
/// excess at distance r after t [K]. Perfusion lets it die away.
double gaussian_pulse(const ThermalTissue& tissue, double energy, double width, double r, double t);

/// The same put in steadily, `power` [W] since t = 0. Without perfusion.
double gaussian_source(const ThermalTissue& tissue, double power, double width, double r, double t);

/// A point that gives `power` [W] since t = 0, at distance r. Without perfusion.
double point_source(const ThermalTissue& tissue, double power, double r, double t);

/// How far a held temperature reaches into perfused tissue in the end: it falls as exp(-x / reach)
/// [m].
double perfused_reach(const ThermalTissue& tissue);

/// Water boils away from a wall held at `wall` excess (above boiling) into tissue at body
/// temperature: Neumann's similarity solution with a dry and a wet phase.
struct BoilingFront {
  BoilingFront(const ThermalTissue& tissue, double wall, double body);

  double position(double t) const;          ///< of the front from the wall [m]
  double excess(double x, double t) const;  ///< [K]

  double lambda = 0.0;  ///< position = 2 lambda sqrt(dry diffusivity t)
  double wall, boiling, dry, wet;
};

/// Power [W] as a Gaussian about `centre`, by its exact integrals over voxels; bricks are made out
/// to five widths.
void heat_gaussian(Bioheat& heat, const Vec3& centre, double width, double power);

/// Sets the excess [K] of all voxels of the bricks that meet the box.
void set_excess(Bioheat& heat, const Box& box, const std::function<double(const Vec3&)>& excess);

/// Volume of the tissue in all bricks [m3].
double tissue_volume(const Bioheat& heat);

/// `energy` [J] over `dt` to all tissue there is, in proportion to its volume.
void heat_evenly(Bioheat& heat, double energy, double dt);

/// Sets one layer of voxels [K]; they must be warm.
void hold_layer(Bioheat& heat, int axis, int layer, double excess);

}  // namespace viscera
