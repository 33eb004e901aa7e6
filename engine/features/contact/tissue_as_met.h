// An organ as one tool meets it: moved and held by everything else that touches it.
#pragma once

#include "engine/simulation/world.h"
#include "haptics/tissue_snapshot.h"

namespace viscera {

/// Fills `snapshot` (all but frame, tick and velocity) with the organ as it is at the end of this
/// frame's step. About the tool's foot: the rigid motion of the tissue by other tools, springs,
/// gravity and so on, and what their hold takes off its answer. Tissue farther than `reach` from
/// the tip isn't sought: `nearest` is then none [m]. False where this frame's contact under the
/// tool has no answer: the snapshot before this one tells more, and shall stay.
bool meet_tissue(World& world, Entity organ, Entity instrument, double reach,
                 TissueSnapshot& snapshot);

}  // namespace viscera
