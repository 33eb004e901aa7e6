// Organs that hang together by what they touch, solved as one.
#pragma once

#include "engine/features/deformation/deformation.h"

namespace viscera {

/// Of Binder (deformation.h).
void solve_islands(World& world, const ContactSolves& solves);
bool is_in_island(const World& world, Entity organ);

}  // namespace viscera
