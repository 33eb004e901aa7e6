// What a run spends time on outside the step; stands after the step's stages in a trace.
#pragma once

#include <array>
#include <string_view>

namespace viscera {

enum class RunStage {
  kRecord,         ///< force curves, measures
  kSplatSmoke,     ///< particles -> density grid
  kWriteVolumes,   ///< hand grids to the OpenVDB writer
  kWriteSurfaces,  ///< deformed organs for ParaView
  kDraw,           ///< picture
  kEncode,         ///< PNG and film
};

inline constexpr std::array<std::string_view, 6> kRunStageNames = {
    "record", "splat smoke", "write volumes", "write surfaces", "draw", "encode"};

}  // namespace viscera
