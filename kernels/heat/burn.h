// First version of the burn: damage grows in a ball around the electrode's contact, in proportion
// to the energy that reaches each voxel. The bioheat and Arrhenius kernels of the next version
// replace this file behind the same call.
#pragma once

#include "kernels/heat/bricks.h"

namespace viscera {

struct BurnParameters {
  double radius = 1.0e-3;  ///< of the heated core for a small tip [m]
  /// Absorbed energy density that chars fully (value 1) [J/m3]. Heating liver from 37 to 100 C and
  /// boiling its water off takes 1079 (3540 * 63 + 0.72 * 2.26e6) = 2.0e9 J/m3; half of a ball on
  /// the surface lies outside the tissue, so all the power in the tissue's half means half of that
  /// for the whole ball.
  double energy_per_volume = 1.0e9;
  /// Share of the power that goes into a wider ball of twice the radius: the coagulated, pale rim,
  /// which falls off smoothly beyond the charred core. Much below a half, the clamped edge of the
  /// core is steeper than half-millimetre voxels resolve, and a burn looks faceted.
  double rim_share = 0.5;
};

/// Adds `power` [W] over `dt` [s] at `rest_position` (rest frame [m]), spread by the smooth compact
/// kernel (1 - s^2)^2 of core and rim, to the damage field (0 sound ... 1 charred, clamped). The
/// contact travels from `previous_position` to `rest_position` during dt: the ball is swept (exact
/// integral along the segment), so that a moving hook leaves a smooth trace at any frame rate.
/// With the default parameters 30 W for 1 s at one spot chars (damage 1) to 1 mm and coagulates
/// (damage above 0.05, the energy that reaches 60 C) to 1.8 mm. A radius below one voxel counts as
/// one voxel. Returns the energy absorbed by voxels not yet charred [J], at most power * dt; the
/// smoke's rate follows it. Without positive finite power, time and radius nothing happens.
double deposit_burn(BrickField& damage, const Vec3& previous_position, const Vec3& rest_position,
                    double power, double dt, const BurnParameters& parameters);

}  // namespace viscera
