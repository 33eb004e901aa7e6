// Cold blades in a bed: what holds two organs together is parted by scissors and scalpels, too.
#pragma once

#include "engine/simulation/feature.h"

namespace viscera {

/// There are a bed and a blade.
bool blades_may_cut_beds(const World& world);

/// Bonds whose strands lie on a scalpel's edge, or where scissors' blades have closed, part
/// -> BedState. It takes no force: strands are thin beside what a blade shears.
void cut_beds(World& world, const FrameContext& context);

}  // namespace viscera
