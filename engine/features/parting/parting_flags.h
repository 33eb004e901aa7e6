// What tissue that parts may have to tell.
#pragma once

#include "engine/simulation/frame_flag.h"

namespace viscera {

/// The report says why.
inline constexpr FrameFlag kCutRefused{
    "cut_refused",
    "an organ couldn't be prepared as it is cut, and moves as it was cut before; report.json says "
    "why (parting): another cut, or finer nodes"};

}  // namespace viscera
