// The parts of a step that clips have.
#pragma once

#include "engine/features/clips/clips.h"

namespace viscera {

/// Appliers that close leave clips, bars come nearer to each other, and the cells that they hold
/// are laid.
void hold_clips(World& world, const FrameContext& context);
/// Once forces are known: Clip::squeeze, and flags of open ducts.
void feel_clips(World& world, const FrameContext& context);
/// After a state was loaded: one that another program made may say anything of clips.
void drop_unsound(World& world);
/// As Feature::replaced has it: clips hold the same tissue of the body that the organ is now.
void hold_what_is_left(World& world, Entity organ, const Continuation* continuation);

}  // namespace viscera
