// A soft block that nothing holds between a floor and a plate that comes down on it: for tests and
// benchmarks.
#pragma once

#include "engine/scene/scene.h"

namespace viscera {

struct BlockBetweenPlates {
  double press = 0.0;     ///< how far the plate comes down [m]
  double time = 3.0;      ///< that it takes; it is slow at both ends [s]
  double spacing = 4e-3;  ///< of the block's nodes [m]
  double pitch = 0.5;     ///< TouchingDescription::pitch
};

inline constexpr double kPressedBlockSide = 30e-3, kPressedBlockHeight = 15e-3;  // [m]

/// Organs "block" of tissue "rubber", "floor" and "plate", without friction and weight.
SceneDescription block_between_plates(const BlockBetweenPlates& options);

}  // namespace viscera
