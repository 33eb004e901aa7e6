// Repulsion sweeps that even out placed nodes.
#pragma once

#include "kernels/points/advancing_front.h"

namespace viscera {

/// Sweeps over the surface nodes alone (`nodes` holds no others yet): each is pushed away from its
/// neighbours and put back on the surface. `sweeps` of the task's options are made.
Result<void> relax_surface(const PlacementTask& task, PlacedNodes& nodes);

/// Sweeps over all nodes: surface nodes slide, interior nodes keep kDepthShare h of depth.
/// `progress` runs from 0 to 1.
Result<void> relax_all(const PlacementTask& task, PlacedNodes& nodes, const Progress& progress);

/// Removes one node of every pair nearer than `share` times the larger wanted spacing: interior
/// before surface, later before earlier.
void separate(double share, PlacedNodes& nodes);

}  // namespace viscera
