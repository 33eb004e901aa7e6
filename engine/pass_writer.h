// A run's ground truth: what each picture is made of, as one OpenEXR file of many channels.
#pragma once

#include <filesystem>
#include <set>
#include <string>
#include <vector>

#include "engine/io/exr_file.h"
#include "engine/render/pass_images.h"
#include "engine/render/view.h"
#include "kernels/base/result.h"

namespace viscera {

enum class Pass {
  kBeauty,
  kClean,
  kScattered,
  kTransmittance,
  kLightTransmittance,
  kDepth,
  kLabels,
  kTemperature
};

/// Passes by their names ("light_transmittance"); one that isn't known is refused with the list.
Result<std::set<Pass>> passes_of(const std::vector<std::string>& names);

/// What a picture's file says of it besides pixels.
struct PassContext {
  std::string scene;
  double time = 0.0;          ///< [s]
  bool with_smoke = false;    ///< the scene has smoke: beauty brings `scattered` with it
};

/// Channels and header of a picture. Colours and transmittances are halves, depth and temperatures
/// floats, labels integers; the header's `comments` tells what each channel is, `labels` (JSON) what
/// each label.
ExrPicture exr_of(const std::set<Pass>& passes, const PassImages& images, const FrameView& view,
                  const PassContext& context);

}  // namespace viscera
