// Which organs hooks may burn, and what is wrong with that.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "engine/features/cautery/cautery.h"

namespace viscera {

/// A hook's metal: a wire as thick as its tip; scissors' is that of their blades.
Electrode electrode_of(const InstrumentDescription& hook);

/// Where hooks pass with current: tissue there may coagulate.
void burn_reach(const SceneDescription& scene, const OrganDescription& organ,
                const std::vector<InstrumentBody>& instruments, Reach& reach);

/// A BurnableOrgan for every organ that a hook with current comes near and whose tissue's thermal
/// values are known. Refuses electrodes and voxels that can't be.
Result<void> prepare_heat(SceneModel& model);
/// Their OrganBurn, and the hooks' BurnTrace.
Result<void> start_heat(World& world);

/// Names organs that a hook with current comes near and that stay cold, since assets/tissues.json
/// doesn't say enough of their tissue.
Result<void> warn_of_cold_organs(SceneModel& model, const std::filesystem::path& assets,
                                 std::vector<std::string>& warnings);

}  // namespace viscera
