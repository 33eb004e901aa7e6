// First version of the burn: damage grows in a ball around the electrode's contact, in proportion to
// the energy that reaches each voxel. The bioheat and Arrhenius kernels of the next version replace
// this file behind the same call.
#pragma once

#include "kernels/heat/bricks.h"

namespace viscera {

struct BurnParameters {
  double radius = 1.0e-3;            ///< of the heated ball for a small tip [m]
  double energy_per_volume = 3.0e8;  ///< absorbed energy density that chars fully (value 1) [J/m3]
};

/// Adds `power` [W] over `dt` [s] at `rest_position` (rest frame [m]), spread by a smooth compact
/// kernel of the radius, to the damage field (0 sound ... 1 charred, clamped). The contact travels
/// from `previous_position` to `rest_position` during dt: the ball is swept, so that a moving hook
/// leaves a smooth trace at any frame rate. Returns the energy absorbed by voxels not yet charred
/// [J]; the smoke's rate follows it.
double deposit_burn(BrickField& damage, const Vec3& previous_position, const Vec3& rest_position,
                    double power, double dt, const BurnParameters& parameters);

}  // namespace viscera
