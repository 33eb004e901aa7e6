// Smoke volumes and the gas around them, as a scene describes them.
#pragma once

#include "engine/scene/scene.h"
#include "engine/world.h"

namespace viscera {

/// Makes the scene's smoke volumes and their gas; after its instruments. Volumes that would need
/// more memory than the machine has are refused, with their size.
Result<void> add_smoke(const SceneDescription& scene, World& world);

/// What a volume will need at most: particles with all that their passes keep, and the written
/// volume's grids [bytes].
std::size_t smoke_memory(const SmokeDescription& smoke);

}  // namespace viscera
