// What a scene says of an organ's breathing.
#pragma once

#include <vector>

#include "engine/scene/feature_keys.h"
#include "engine/scene/scene.h"

namespace viscera {

/// The organ's frame moves from its pose along a line and back, again and again.
struct MotionDescription {
  double amplitude = 0.0;           ///< greatest way [m]
  Vec3 direction = -Vec3::UnitY();  ///< unit, world
  double period = 4.0;              ///< [s]
  double phase = 0.0;               ///< of the breath at time 0 [rad]; a whole breath is 2 pi

  /// amplitude sin^4(pi t / period + phase / 2) along the direction: a breath with its pause after
  /// expiration [Lujan1999].
  Vec3 displacement(double time) const;
  Vec3 velocity(double time) const;  ///< its rate [m/s]
};

/// What holds an organ's surface in one region of `fixed` moves so, against its frame.
struct HoldMotion {
  int hold = 0;  ///< index of the region
  MotionDescription motion;
};

/// Ascending; empty: all of its holds go with its frame.
const std::vector<HoldMotion>& hold_motions_of(const OrganDescription& organ);
void set_hold_motions(OrganDescription& organ, std::vector<HoldMotion> motions);

/// Null: the organ stays.
const MotionDescription* motion_of(const OrganDescription& organ);
/// Its FrameMotion follows it.
void set_motion(OrganDescription& organ, const MotionDescription& motion);

FeatureKeys breathing_keys();

}  // namespace viscera
