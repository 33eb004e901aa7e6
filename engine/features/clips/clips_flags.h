// What clips may have to tell.
#pragma once

#include "engine/simulation/frame_flag.h"

namespace viscera {

/// The applier keeps its clip.
inline constexpr FrameFlag kClipOnNothing{
    "clip_on_nothing",
    "a clip applier closed where no tissue lay between its bars: bring it so that tissue reaches "
    "in "
    "from side to side, or give it a greater clip_opening_mm"};
inline constexpr FrameFlag kNoClipLeft{
    "no_clip_left", "a clip applier closed with no clip left: give it more \"clips\""};
inline constexpr FrameFlag kClipFell{
    "clip_fell", "what a clip held was cut or burnt away: apply it farther from the cut"};
inline constexpr FrameFlag kDuctOpen{
    "duct_open",
    "a duct or vessel is cut, and no clip closes it towards what feeds it: apply one there before "
    "the cut, that holds its pressure (report.json, clips, ducts)"};

}  // namespace viscera
