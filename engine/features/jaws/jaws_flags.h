// What jaws that hold by their force may have to tell.
#pragma once

#include "engine/simulation/frame_flag.h"

namespace viscera {

/// The jaws stay closed on nothing until they open.
inline constexpr FrameFlag kTissueLeftJaws{
    "tissue_left_jaws",
    "tissue slid out of closed jaws, and none is left between them: open and close them on it "
    "again, pull less, or give them a greater grip_force_N or jaw_friction"};
/// They still rub with all of their force.
inline constexpr FrameFlag kJawsShut{
    "jaws_shut",
    "jaws squeezed tissue to a third of its thickness before it bore their force, and closed no "
    "farther: the squeeze there is less than grip_force_N; a smaller one, or stiffer tissue"};

}  // namespace viscera
