// Organs that hang together by what they touch, solved as one.
#pragma once

#include "engine/features/deformation/deformation.h"

namespace viscera {

/// The pairs that meet in this frame and the organs that these and links tie together.
struct Island {
  std::vector<Entity> pairs;
  std::vector<Entity> organs;  ///< that yield
};
/// Of those that don't rest.
std::vector<Island> islands_of(const World& world);

/// Of Binder (deformation.h).
void solve_islands(World& world, const ContactSolves& solves);
bool is_in_island(const World& world, Entity organ);

}  // namespace viscera
