// Which walls a device and a hand can touch without rattling: the range of stiffness and damping
// that a loop can show [Colgate1994].
#pragma once

#include "haptics/devices/simulated_device.h"
#include "haptics/servo_tick.h"

namespace viscera {

struct ZWidthCase {
  DeviceLimits device = phantom_premium_1_0a();
  double grip = 0.5;          ///< Hand::with_grip
  double stiffness = 1000.0;  ///< [N/m] of the coupling, behind which the wall is rigid
  double damping = 0.0;       ///< [N s/m] of the coupling
  bool passivity = true;      ///< the passivity controller works
};

struct ZWidthTrial {
  double rattle = 0.0;  ///< [m/s] root mean square of the handle's speed once the hand has settled
  double given = 0.0;   ///< [J] net to the hand
  double force = 0.0;   ///< [N] mean over the same while
  bool stable = false;  ///< rattle below a millimetre a second, which a fingertip hardly feels
};

/// A hand presses into a rigid wall, for 1 N or as far as 3 cm carry, and holds still there.
ZWidthTrial press_wall(const ZWidthCase& trial);

/// [N/m] the greatest stiffness below which every wall on a geometric grid is stable, up to `most`;
/// zero where none is.
double greatest_stable_stiffness(ZWidthCase trial, double most = 1e5);

}  // namespace viscera
