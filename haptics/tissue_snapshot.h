// What the frame tells the servo thread of one organ, sixty times a second.
#pragma once

#include <cstdint>
#include <vector>

#include "kernels/base/fields.h"
#include "kernels/points/surface.h"

namespace viscera {

/// Filled in place and exchanged whole (TripleBuffer), so that neither thread waits for the other.
struct TissueSnapshot {
  std::uint64_t frame = 0;
  std::uint64_t tick = 0;        ///< up to which this is the scene's state
  Pose pose;                     ///< of the organ's frame, in the scene's
  Vec3 velocity = Vec3::Zero();  ///< of that frame, by breathing [m/s]
  /// Displacement of the surface's vertices by everything but the tool that asks [m]; empty: none.
  std::vector<Vec3f> free;
  /// The place nearest to the tool by the scene's own search, where a walk begins that lost its
  /// way; no triangle: the tool is far.
  SurfacePoint nearest;

  static constexpr auto fields() {
    return std::tuple(
        field("frame", &TissueSnapshot::frame), field("tick", &TissueSnapshot::tick),
        field("pose", &TissueSnapshot::pose), field("velocity", &TissueSnapshot::velocity),
        field("free", &TissueSnapshot::free), field("nearest", &TissueSnapshot::nearest));
  }
};
static_assert(fields_cover<TissueSnapshot>());

}  // namespace viscera
