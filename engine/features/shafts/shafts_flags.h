// What shafts that touch may have to tell.
#pragma once

#include "engine/simulation/frame_flag.h"

namespace viscera {

/// A place of it was inside and hadn't been seen to go in.
inline constexpr FrameFlag kShaftInside{
    "shaft_inside",
    "a shaft was found inside an organ that it hadn't been pressed into: tissue came to it faster "
    "than a frame can follow; it is pushed out on the nearest side"};

inline constexpr FrameFlag kToolsCross{
    "tools_cross",
    "two instruments lay over 2 mm in each other: paths that cross, or a hand that presses harder "
    "than their shafts bear; lead them around each other"};

}  // namespace viscera
