// Everything that passes draw, on the GPU: kept over the pictures by id, uploaded when it changed.
#pragma once

#include <cstdint>
#include <map>
#include <vector>

#include "engine/render/instrument_buffers.h"
#include "engine/render/organ_buffers.h"
#include "engine/render/smoke_texture.h"
#include "engine/render/strand_buffers.h"
#include "engine/render/view.h"
#include "kernels/base/result.h"

namespace viscera {

struct SceneBuffers {
  std::map<std::uint32_t, OrganBuffers> organs;
  std::map<std::uint32_t, InstrumentBuffers> instruments;
  std::map<std::uint32_t, StrandBuffers> beds;
  std::vector<SmokeTexture> smoke;

  /// Uploads what changed; forgets what is gone. `with_temperature`: the smoke's, too.
  Result<void> update(const FrameView& view, bool with_temperature = false);
};

/// Organ or instrument frame to world.
Eigen::Matrix4f model_matrix(const Pose& pose);
Eigen::Matrix4f model_matrix(const InstrumentView& view);

}  // namespace viscera
