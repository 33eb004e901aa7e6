// What organs that nothing holds may have to tell.
#pragma once

#include "engine/simulation/frame_flag.h"

namespace viscera {

/// It stays where it was seen last. Which, and when, the report's warnings say.
inline constexpr FrameFlag kOutOfView{
    "out_of_view",
    "an organ that nothing holds fell out of view: lay something below it, or give it `fixed`"};

}  // namespace viscera
