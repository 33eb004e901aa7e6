#include "engine/scene/scene.h"

namespace viscera {

Pose OrganDescription::pose_at(double time) const {
  Pose now = pose;
  if (const auto* motion = extras.find<FrameMotion>()) now.position += motion->displacement(time);
  return now;
}

}  // namespace viscera
