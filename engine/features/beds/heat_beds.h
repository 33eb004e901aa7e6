// Heat and beds: what goes through their bonds, and what parts them.
#pragma once

#include "engine/simulation/feature.h"

namespace viscera {

/// Something with current may come to a bed.
bool beds_may_burn(const World& world);
/// Tissue of a bed's organ is warm.
bool beds_are_warm(const World& world);

/// Heat goes from the warmer organ to the other through bonds that hold, by their area, the gap
/// that they bridge and the tissues' conductivity -> OrganBurn, before it spreads there.
void warm_beds(World& world, const FrameContext& context);

/// Bonds that lie on live metal, of hooks or scissors, or whose ends are hot, part -> BedState.
void burn_beds(World& world, const FrameContext& context);

}  // namespace viscera
