// Organs without a global response: hives about the tips are all that answers (LPAFF), and what
// they say of the surface near a tip is what is drawn.
#pragma once

#include "engine/frame.h"
#include "engine/world.h"

namespace viscera {

/// Gives every deformable organ of the scene with `response: local` its hives, one for each
/// instrument. Fails, naming both, for an instrument whose tip isn't a ball.
Result<void> add_local_organs(const SceneDescription& scene, World& world);

/// Tips -> forces, OrganState, deformed surfaces of local organs. One without a tip near costs a
/// test for each instrument.
void deform_local_organs(World& world, const FrameContext& context);

/// The nearest place of an organ's surface as it is now, whatever it answers with; within `radius`
/// [m] of a place of the world.
std::optional<CollisionSurface::Hit> nearest_tissue(const World& world, Entity organ,
                                                    const Vec3& at, double radius);

}  // namespace viscera
