// What finding contacts may have to tell.
#pragma once

#include "engine/simulation/frame_flag.h"

namespace viscera {

/// There is no response there.
inline constexpr FrameFlag kOutOfReach{
    "out_of_reach",
    "a tip touched tissue where no place of the surface was near enough to take its force: a "
    "smaller spacing_mm"};
/// No tissue lay within its grip radius.
inline constexpr FrameFlag kGripMissed{
    "grip_missed", "a jaw closed on nothing: move its closing key nearer to the tissue"};

}  // namespace viscera
