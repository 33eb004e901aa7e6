// A scene's instruments: bodies with their paths, and where these put them.
#pragma once

#include <vector>

#include "engine/simulation/components.h"
#include "kernels/base/result.h"

namespace viscera {

/// A tool slower than this stands still: what it presses has settled [m/s].
inline constexpr double kStandsStill = 1e-3;

/// The scene's instruments with their paths; imports mesh tips.
Result<std::vector<InstrumentBody>> make_instruments(const SceneDescription& scene);

/// Where an instrument's key frames put it at `time` [s].
void place_tool(const InstrumentBody& body, double time, InstrumentState& state);
/// The tip there, the shaft through its trocar.
void aim_tool(const InstrumentBody& body, const Vec3& tip, InstrumentState& state);

/// Refuses instruments whose tips reach into this organ's surface at the start.
Result<void> check_tips(const SceneDescription& scene,
                        const std::vector<InstrumentBody>& instruments,
                        const OrganDescription& organ, const TriangleSurface& surface);

}  // namespace viscera
