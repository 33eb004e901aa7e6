#include <algorithm>

#include "engine/systems/systems.h"
#include "engine/systems/tissue_changes.h"

namespace viscera {

void sag_organs(World& world, const FrameContext& context) {
  const std::vector<Entity> reshaped = use_due_changes(world, context.frame);
  const Vec3 change = world.gravity ? world.gravity->change_at(context.time) : Vec3::Zero();
  for (std::size_t o = 0; o < world.organ_sags.size(); ++o) {
    OrganSag& sag = world.organ_sags[o];
    const Entity organ = world.organ_sags.owner(o);
    const OrganBody& body = *world.organ_bodies.find(organ);
    // Breathing moves an organ's frame without turning it.
    const Vec3 local = body.pose.direction_to_local(change);
    sag.changed =
        local != sag.change || std::find(reshaped.begin(), reshaped.end(), organ) != reshaped.end();
    if (!sag.changed) continue;
    sag.change = local;
    sag_places(*body.model, local, sag.places);
    for (std::size_t i = 0; i < sag.shrunk.size(); ++i) sag.places[i] += sag.shrunk[i];
    carry_displacements(body.model->drawn, sag.places, sag.vertices);
  }
}

}  // namespace viscera
