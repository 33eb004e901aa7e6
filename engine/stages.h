// The stages of a step, in order: the profiler, the report, the trace and ARCHITECTURE.md print
// these names.
#pragma once

#include <array>
#include <string_view>

namespace viscera {

enum class Stage {
  kReadTools,      ///< key frames -> tip, current, jaw
  kRunServos,      ///< held tools: device, tissue, force, a thousand times a second
  kMoveOrgans,     ///< breathing: the organs' frames
  kSagOrgans,      ///< gravity: the organs' shapes where nothing touches them
  kFindContacts,   ///< Embree: which tissue lies under which tip
  kDeformOrgans,   ///< contact forces, displacement, drawn surface
  kHeatTissue,     ///< burns in rest-space bricks
  kEmitSmoke,      ///< smoke that the burns give off
  kMoveSmoke,      ///< particles by eq. 14
  kFetchSurfaces,  ///< positions that the GPU deformed meanwhile
  kPublish,        ///< snapshot for readers on other threads (haptics)
  kCheck,          ///< non-finite values freeze their organ
  kRecord,         ///< force curves, state hash
  // Outside the step, on frames that are filmed:
  kSplatSmoke,     ///< particles -> density grid
  kWriteVolumes,   ///< hand grids to the OpenVDB writer
  kWriteSurfaces,  ///< deformed organs for ParaView
  kDraw,           ///< picture
  kEncode,         ///< PNG and film
};

inline constexpr std::array<std::string_view, 18> kStageNames = {
    "read tools",     "run servos",  "move organs", "sag organs",  "find contacts",
    "deform organs",  "heat tissue", "emit smoke",  "move smoke",  "fetch surfaces",
    "publish",        "check",       "record",      "splat smoke", "write volumes",
    "write surfaces", "draw",        "encode"};

constexpr int stage_index(Stage stage) {
  return static_cast<int>(stage);
}

}  // namespace viscera
