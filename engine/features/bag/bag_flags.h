// What a retrieval bag may have to tell.
#pragma once

#include "engine/simulation/frame_flag.h"

namespace viscera {

inline constexpr FrameFlag kBagEmpty{
    "bag_empty",
    "a bag's mouth closed on no piece: a piece is kept that was cut off, that no hold of its organ "
    "has, and of which 95 % lie in the sack; open the bag and bring it about the piece"};

}  // namespace viscera
