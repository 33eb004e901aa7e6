// What burning may have to tell.
#pragma once

#include "engine/simulation/frame_flag.h"

namespace viscera {

inline constexpr FrameFlag kHeatFull{
    "heat_full",
    "heat found no room for more of an organ's voxels; tissue beyond them counted as cold: a "
    "greater heat/voxel_mm"};
inline constexpr FrameFlag kNotHeated{
    "not_heated",
    "a hook gave current to an organ that isn't heated: its tissue lacks thermal values, or its "
    "path had not announced that it comes there"};

}  // namespace viscera
