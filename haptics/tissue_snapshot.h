// What the frame tells the servo thread of one organ, sixty times a second.
#pragma once

#include <cstdint>

#include "kernels/base/fields.h"
#include "kernels/hive/foot_hold.h"
#include "kernels/points/surface.h"

namespace viscera {

/// Filled in place and exchanged whole (TripleBuffer), so that neither thread waits for the other.
struct TissueSnapshot {
  std::uint64_t frame = 0;
  std::uint64_t tick = 0;  ///< up to which this is the scene's state
  /// Of the organ's frame, in the scene's, with what everything but the tool that asks does to the
  /// tissue about its foot: a rigid motion of that tissue at rest.
  Pose pose;
  Vec3 velocity = Vec3::Zero();  ///< of that frame, by breathing [m/s]
  FootHold hold;                 ///< of everything but that tool, about its foot
  /// The place nearest to the tool by the scene's own search, where a walk begins that lost its
  /// way; no triangle: the tool is far.
  SurfacePoint nearest;

  static constexpr auto fields() {
    return std::tuple(
        field("frame", &TissueSnapshot::frame), field("tick", &TissueSnapshot::tick),
        field("pose", &TissueSnapshot::pose), field("velocity", &TissueSnapshot::velocity),
        field("hold", &TissueSnapshot::hold), field("nearest", &TissueSnapshot::nearest));
  }
};
static_assert(fields_cover<TissueSnapshot>());

}  // namespace viscera
