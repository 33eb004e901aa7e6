// Which organs hooks may burn, and what is wrong with that.
#pragma once

#include <cstddef>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "engine/world.h"

namespace viscera {

class EglContext;

/// A hook's metal: a wire as thick as its tip.
Electrode electrode_of(const InstrumentDescription& hook);

/// An OrganBurn for every organ that a hook with current comes near and whose tissue's thermal
/// values are known. Refuses electrodes and voxels that can't be.
Result<void> add_heat(const SceneDescription& scene, World& world);

/// Has the heat of every OrganBurn computed in `context` from now on; how many there are. Where the
/// kernels don't compile it fails, and all stays on the CPU. What goes wrong later,
/// Bioheat::device_failure() says.
Result<std::size_t> move_heat_to_gpu(World& world, std::shared_ptr<EglContext> context);

/// Names organs that a hook with current comes near and that stay cold, since `file` doesn't say
/// enough of their tissue.
void warn_of_cold_organs(const SceneDescription& scene, const World& world,
                         const std::filesystem::path& file, std::vector<std::string>& warnings);

}  // namespace viscera
