#include "engine/systems/systems.h"

namespace viscera {

void sag_organs(World& world, const FrameContext& context) {
  const Vec3 change = world.gravity->change_at(context.time);
  for (std::size_t o = 0; o < world.organ_sags.size(); ++o) {
    OrganSag& sag = world.organ_sags[o];
    const OrganBody& body = *world.organ_bodies.find(world.organ_sags.owner(o));
    // Breathing moves an organ's frame without turning it.
    const Vec3 local = body.pose.direction_to_local(change);
    sag.changed = local != sag.change;
    if (!sag.changed) continue;
    sag.change = local;
    sag_places(*body.model, local, sag.places);
    carry_displacements(body.model->drawn, sag.places, sag.vertices);
  }
}

}  // namespace viscera
