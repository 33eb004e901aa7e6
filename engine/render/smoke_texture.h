// The density of a smoke volume on the GPU, with the box that holds its smoke.
#pragma once

#include "engine/gpu/texture.h"
#include "engine/render/view.h"
#include "kernels/base/result.h"

namespace viscera {

class SmokeTexture {
 public:
  /// Uploads the density and finds where any is. Fails when density and size don't match.
  Result<void> update(const SmokeView& view);
  bool empty() const { return filled_.isEmpty(); }
  const Texture& density() const { return density_; }
  const Box& filled() const { return filled_; }  ///< [m]; march only here

 private:
  Texture density_;
  Box filled_;
};

}  // namespace viscera
