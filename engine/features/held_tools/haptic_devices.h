// The device that a scene's instrument is held through.
#pragma once

#include <memory>

#include "engine/features/held_tools/held_tools_keys.h"
#include "engine/simulation/key_frames.h"
#include "haptics/device.h"
#include "kernels/base/result.h"

namespace viscera {

struct OpenedDevice {
  std::unique_ptr<HapticDevice> device;
  Pose placement;  ///< of the device's frame in the scene
};

/// The device of an instrument that is held, its work space put about the middle of the
/// instrument's path, which a modelled hand follows again and again for `seconds`. Fails where the
/// path doesn't fit into it, a recording can't be read, or a port is taken.
Result<OpenedDevice> open_device(const InstrumentDescription& instrument, const KeyFrames& path,
                                 double seconds);

}  // namespace viscera
