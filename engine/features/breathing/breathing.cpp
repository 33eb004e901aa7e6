#include "engine/features/breathing/breathing.h"

namespace viscera {
namespace {

Result<void> prepare(SceneModel& model) {
  for (std::size_t o = 0; o < model.organs().size(); ++o) {
    const OrganDescription& organ = model.scene().organs[o];
    if (const MotionDescription* motion = motion_of(organ))
      model.constants().all<OrganMotion>().add(model.organs()[o],
                                               {.pose = organ.pose, .motion = *motion});
  }
  return {};
}

void move_organs(World& world, const FrameContext& context) {
  const Pool<OrganMotion>& motions = world.all<OrganMotion>();
  for (std::size_t i = 0; i < motions.size(); ++i) {
    const Entity organ = motions.owner(i);
    Pose& pose = world.find<OrganPose>(organ)->pose;
    const Vec3 last = pose.position;
    pose.position = motions[i].pose.position + motions[i].motion.displacement(context.time);
    // Surfaces stay as they are in the organ's own frame; only their box is kept in the world's.
    if (OrganTouch* touch = world.find<OrganTouch>(organ))
      touch->bounds.translate(pose.position - last);
  }
}

}  // namespace

Feature breathing_feature() {
  return {.name = "breathing",
          .keys = breathing_keys(),
          .prepare = prepare,
          .stages = {{.name = "move organs",
                      .writes = {"organ poses"},
                      .changes = {"organ poses", "organ contacts"},
                      .needed = [](const World& world) { return world.has<OrganMotion>(); },
                      .run = move_organs}}};
}

}  // namespace viscera
