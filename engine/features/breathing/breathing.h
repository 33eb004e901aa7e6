// Breathing: an organ's frame goes from its pose along a line and back.
#pragma once

#include "engine/features/breathing/breathing_keys.h"
#include "engine/simulation/feature.h"

namespace viscera {

/// Organs that breathe.
struct OrganMotion {
  static constexpr bool kConstant = true;
  Pose pose;  ///< of the frame without the motion
  MotionDescription motion;
};

Feature breathing_feature();

}  // namespace viscera
