// A bar pressed or pulled along one axis, its sides free, of the law of tissue at finite strain
// (kernels/finite/finite_body.h):
//   W = mu/2 (|F|^2 - 3) - mu (J - 1) + (lambda + mu)/2 (J - 1)^2,  F = diag(l, t, t).
// That its sides are free, dW/dt = 0, gives t; its stress follows. Between plates without friction
// a block is strained evenly so, at any height.
#pragma once

#include "kernels/paff/elasticity.h"

namespace viscera {

struct UniaxialAnswer {
  double stretch = 1.0;   ///< along the axis
  double across = 1.0;    ///< of the sides
  double nominal = 0.0;   ///< force over the area at rest; below 0: it is pressed [Pa]
  double pressure = 0.0;  ///< over the area as it is, above 0 where it is pressed [Pa]
};

/// `stretch` over 0.
UniaxialAnswer uniaxial(const IsotropicMaterial& material, double stretch);
/// The stretch at which so great a pressure presses it; at least .05.
UniaxialAnswer pressed_to(const IsotropicMaterial& material, double pressure);

}  // namespace viscera
