// What shafts that touch organs may have to tell.
#pragma once

#include "engine/simulation/frame_flag.h"

namespace viscera {

/// A place of it was inside and hadn't been seen to go in.
inline constexpr FrameFlag kShaftInside{
    "shaft_inside",
    "a shaft was found inside an organ that it hadn't been pressed into: tissue came to it faster "
    "than a frame can follow; it is pushed out on the nearest side"};

}  // namespace viscera
