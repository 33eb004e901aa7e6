// What emitting smoke may have to tell.
#pragma once

#include "engine/simulation/frame_flag.h"

namespace viscera {

inline constexpr FrameFlag kSmokeFull{
    "smoke_full", "a smoke volume was full; its oldest particles ended: raise max_particles"};
inline constexpr FrameFlag kSmokeOutside{
    "smoke_outside",
    "tissue burnt outside every smoke volume; that smoke was not followed: enlarge a domain"};

}  // namespace viscera
