// The look of smoke in [De2006]: a textured square a particle, facing the lens.
#pragma once

#include <vector>

#include "engine/gpu/buffer.h"
#include "engine/render/canvas.h"

namespace viscera {

class SmokeSprites {
 public:
  static Result<SmokeSprites> create();
  /// Draws the particles of all volumes that look so into `canvas.smoke`, from far to near. False
  /// when there are none. Fails where particles, radii and masses don't match.
  Result<bool> draw(const FrameView& view, const Canvas& canvas);

 private:
  struct Sprite {
    float x, y, z, radius, mass;
  };
  Program program_;
  Texture puff_;
  Buffer buffer_;
  VertexArray array_;
  std::vector<Sprite> sprites_;
};

}  // namespace viscera
