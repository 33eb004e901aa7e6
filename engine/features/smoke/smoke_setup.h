// Smoke volumes, as a scene describes them.
#pragma once

#include "engine/features/smoke/smoke.h"

namespace viscera {

/// The scene's smoke volumes. Those that would need more memory than the machine has are refused,
/// with their size.
Result<void> prepare_smoke(SceneModel& model);
Result<void> start_smoke(World& world);
/// Reads assets/smoke.json.
Result<void> load_sight(SceneModel& model, const std::filesystem::path& assets,
                        std::vector<std::string>& warnings);

std::shared_ptr<const SurfaceTopology> topology_of(const TriangleSurface& surface);

/// What a volume will need at most: particles with all that their passes keep, and the written
/// volume's grids [bytes].
std::size_t smoke_memory(const SmokeDescription& smoke);

}  // namespace viscera
