// A soft block that nothing holds, above a floor that doesn't move: for tests and benchmarks.
#pragma once

#include "engine/scene/scene.h"

namespace viscera {

struct BlockOnFloor {
  double above = 0.0;     ///< the floor, to begin with [m]
  double friction = 0.0;  ///< coefficient between both
  double slope = 0.0;     ///< gravity pulls so far aside, to -y [rad]
  double spacing = 6e-3;  ///< of the block's nodes [m]
  double pitch = 0.5;     ///< TouchingDescription::pitch
};

/// 30 x 30 x 15 mm, of tissue "rubber".
SceneDescription block_on_floor(const BlockOnFloor& options);

}  // namespace viscera
