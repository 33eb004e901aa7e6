// Where heat or blades have gone through the walls of hollow organs. These are solid here: a wall
// is gone through where what is gone from the skin on reaches as deep as the wall is thick.
#pragma once

#include <vector>

#include "engine/simulation/feature.h"

namespace viscera {

struct WallFigures {
  Entity organ;
  double wall = 0.0;             ///< how thick it is [m]
  std::size_t perforations = 0;  ///< places, each in one
  double depth = 0.0;            ///< of what is gone, where it is deepest [m]
};

/// Of organs whose wall the scene knows (`wall_mm`).
std::vector<WallFigures> wall_figures(const World& world);

}  // namespace viscera
