// Takes a world's work to the GPU, as far as a run computes there.
#pragma once

#include "engine/gpu/backend.h"
#include "engine/io/report.h"
#include "engine/simulation/world.h"

namespace viscera {

/// Organs, smoke and heat. Where one of them fails, only a run that asked for the GPU does too;
/// otherwise it stays on the CPU with a warning. `report` gets what went where.
Result<void> move_world_to_gpu(World& world, const ComputeDevice& device, Backend asked,
                               RunReport& report);

}  // namespace viscera
