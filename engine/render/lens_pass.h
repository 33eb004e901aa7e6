// From linear light to what the camera head shows: spill, exposure, distortion, tone curve, the
// round field of view, sharpening and sensor noise.
#pragma once

#include "engine/render/canvas.h"

namespace viscera {

class LensPass {
 public:
  static Result<LensPass> create(const QualitySettings& settings);
  /// Light that spills over in the lens, and how bright the picture is.
  void meter(const Canvas& canvas);
  /// Writes `canvas.shown`, rows from the top.
  void develop(const Canvas& canvas);

 private:
  Program small_, meter_, bright_, blur_;
  Program develop_, show_;
};

}  // namespace viscera
