#include "engine/systems/systems.h"

namespace viscera {

void move_organs(World& world, const FrameContext& context) {
  for (std::size_t i = 0; i < world.organ_motions.size(); ++i) {
    const Entity organ = world.organ_motions.owner(i);
    const OrganMotion& breathing = world.organ_motions[i];
    OrganBody& body = *world.organ_bodies.find(organ);
    const Vec3 last = body.pose.position;
    body.pose.position = breathing.pose.position + breathing.motion.displacement(context.time);
    // Surfaces stay as they are in the organ's own frame; only their box is kept in the world's.
    if (OrganContact* contact = world.organ_contacts.find(organ))
      contact->bounds.translate(body.pose.position - last);
  }
}

}  // namespace viscera
