// Before a scene with tissue that parts starts: what it may ask for, and what is prepared.
#pragma once

#include "engine/simulation/feature.h"

namespace viscera {

// As Feature has them: check, reach, finish and start.

/// What can't be cut beside it as yet, and blades with nothing to cut.
Result<void> check_parting(const SceneDescription& scene,
                           const std::map<std::string, Tissue>& tissues);
/// Organs that may be cut are touched and strained anywhere.
void reach_of_cuts(const SceneDescription& scene, const OrganDescription& organ,
                   const std::vector<InstrumentBody>& instruments, Reach& reach);
/// Makes them cuttable; refuses walls thicker than their organ, and paths of blades that stay away
/// from all that they could cut.
Result<void> finish_parting(SceneModel& model, const std::filesystem::path& assets,
                            std::vector<std::string>& warnings);
/// Nothing is gone from them yet.
Result<void> start_parting(World& world);

}  // namespace viscera
