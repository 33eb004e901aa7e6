// The stages of deform_organs.cpp.
#pragma once

#include "engine/simulation/frame.h"

namespace viscera {

/// OrganContact.cells -> forces, OrganState, deformed surfaces (where a GPU makes these, it
/// starts). Organs without cells that are at rest cost one test.
void deform_organs(World& world, const FrameContext& context);
/// What the GPU made of this frame's loads -> OrganState, deformed surfaces.
void fetch_surfaces(World& world, const FrameContext& context);
/// An organ whose shape isn't finite is at rest where it isn't, stays so and answers no force.
void freeze_organ(World& world, Entity organ);

/// Of an organ that is another body: the shape that it has without tools' dents, which come back
/// with the next step.
void take_shape_of_body(World& world, Entity organ, const Continuation*);

}  // namespace viscera
