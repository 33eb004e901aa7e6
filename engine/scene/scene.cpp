#include "engine/scene/scene.h"

namespace viscera {

Pose OrganDescription::pose_at(double time) const {
  Pose now = pose;
  if (const auto* motion = extras.find<FrameMotion>()) now.position += motion->displacement(time);
  return now;
}

void set_steps(SceneDescription& scene, const StepRate& steps) {
  scene.steps = steps;
  for (OrganDescription& organ : scene.organs) organ.finite.time_step = steps.step();
}

}  // namespace viscera
