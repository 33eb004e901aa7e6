// Breathing: an organ's frame goes from its pose along a line and back, or some of its holds do.
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

/// Organs of which some holds breathe by themselves.
struct MovingHolds {
  static constexpr bool kConstant = true;
  std::vector<HoldMotion> motions;
};

/// How far each of these has moved since the organ's rest shape.
struct HoldWays {
  static constexpr std::string_view kName = "moving holds";
  std::vector<Vec3> ways;    ///< organ frame [m]
  std::vector<Vec3> before;  ///< a frame ago
  static constexpr auto fields() {
    return std::tuple(field("ways", &HoldWays::ways), field("before", &HoldWays::before));
  }
};
static_assert(fields_cover<HoldWays>());

Feature breathing_feature();

}  // namespace viscera
