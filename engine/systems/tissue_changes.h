// How organs' elasticity follows the tissue that heat coagulates: the stiffness of what has
// coagulated, and the shape that its shrinkage leaves.
//
// An update takes longer than a frame, so it is computed beside the frames and used from a frame on
// that its size alone decides: a run is the same on any machine, which waits where it is slower.
#pragma once

#include <vector>

#include "engine/world.h"

namespace viscera {

/// An organ on which gravity has not changed.
OrganSag level_sag(const OrganModel& model);

/// Looks at the heat of burnt organs now and then, and where enough has changed starts an update.
void follow_changes(World& world, std::uint64_t frame);

/// Hands updates that are due to the organs' contacts and shapes; returns whose. Waits for them.
std::vector<Entity> use_due_changes(World& world, std::uint64_t frame);

}  // namespace viscera
