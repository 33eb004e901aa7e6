// A ball pressed into a flat, deep body of hyperelastic tissue, without friction, solved to the
// end: the reference for hives beyond linear. Shares nothing with them but the law at a point:
// nine-node elements, the law at each of nine points, contact by the ball's own distance at points
// of the surface.
#pragma once

#include <vector>

#include "kernels/hive/hyperelastic_model.h"
#include "kernels/paff/elasticity.h"

namespace viscera {

struct PressedBlockOptions {
  HyperelasticModel model = HyperelasticModel::kNeoHookean;
  IsotropicMaterial material{1.0, 0.45};
  double ball_radius = 1.0;    ///< [m]
  std::vector<double> depths;  ///< of the ball's lowest point, rising [m]
  int elements = 8;            ///< across one radius of the ball
};

/// Force [N] at each depth; fewer where Newton's method finds no equilibrium: St Venant-Kirchhoff
/// tissue has none beyond some depth. Takes seconds.
std::vector<double> press_block(const PressedBlockOptions& options);

}  // namespace viscera
