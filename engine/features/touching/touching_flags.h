// What organs that touch each other may have to tell.
#pragma once

#include "engine/simulation/frame_flag.h"

namespace viscera {

/// Beyond what they overlap at rest. The forces there are too small, and the report says how deep.
inline constexpr FrameFlag kOrgansOverlap{
    "organs_overlap",
    "an organ lay over 1 mm inside another that it touches, so that forces there are too small: "
    "a smaller contact/organ_pitch, finer nodes, or less pressure"};

}  // namespace viscera
