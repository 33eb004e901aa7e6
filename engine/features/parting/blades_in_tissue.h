// Where the blades of scissors stand in tissue that they cut: for current through them.
#pragma once

#include <optional>

#include "engine/simulation/world.h"

namespace viscera {

/// As the step's cuts have left them (OrganCut::blades).
struct BladesInTissue {
  Entity organ;                ///< of several that which most of their edges is in
  Vec3 middle = Vec3::Zero();  ///< of the edge in tissue of the blade that has most; at rest [m]
  bool below = false;          ///< that place lies below the drawn surface, else in a kerf
  double area = 0.0;           ///< of all blades: their thickness times the length in tissue [m2]
};

/// None: no scissors, or their edges are in no organ that they cut.
std::optional<BladesInTissue> blades_in_tissue(const World& world, Entity instrument);

}  // namespace viscera
