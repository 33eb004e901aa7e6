// What tissue that parts may have to tell.
#pragma once

#include "engine/simulation/frame_flag.h"

namespace viscera {

/// The report says why.
inline constexpr FrameFlag kCutRefused{
    "cut_refused",
    "an organ couldn't be prepared as it is cut, and moves as it was cut before; report.json says "
    "why (parting): another cut, or finer nodes"};

/// Once each time that jaws come to their trocar with it.
inline constexpr FrameFlag kPieceStuck{
    "piece_stuck",
    "jaws came to their trocar with a piece that is wider than its bore, and it stays in the body: "
    "a wider trocar (bore_mm), or smaller pieces"};

}  // namespace viscera
