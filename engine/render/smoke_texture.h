// The density of a smoke volume on the GPU, with where it holds smoke.
#pragma once

#include <vector>

#include "engine/gpu/texture.h"
#include "engine/render/view.h"
#include "kernels/base/result.h"

namespace viscera {

class SmokeTexture {
 public:
  /// Uploads the density, with the temperature beside it where it is wanted and known, and finds
  /// where any smoke is. Fails when arrays and size don't match.
  Result<void> update(const SmokeView& view, bool with_temperature);
  bool empty() const { return bricks_.empty(); }
  /// r: density [kg/m3]; g: temperature excess [K], 0 where it isn't kept.
  const Texture& density() const { return density_; }
  const Box& filled() const { return filled_; }  ///< [m]; march only here
  /// Blocks of cells that hold smoke, with the cells to which filtering spreads it [m].
  const std::vector<Box>& bricks() const { return bricks_; }

 private:
  void find_bricks(const SmokeView& view);

  Texture density_;
  unsigned format_ = 0;
  std::vector<float> both_;
  Box filled_;
  std::vector<Box> bricks_;
};

}  // namespace viscera
