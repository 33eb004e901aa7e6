// What lies where: the depth of all that is seen, laid before anything is shaded, since tissue is
// costly and occlusion looks at the depth.
#pragma once

#include "engine/render/canvas.h"
#include "engine/render/scene_buffers.h"

namespace viscera {

class DepthPass {
 public:
  static Result<DepthPass> create();
  void draw(const FrameView& view, const SceneBuffers& buffers, const Canvas& canvas);

 private:
  Program field_, organ_, instrument_, strand_;
};

/// Ambient occlusion and the contact shadows of the lens light, at half the shaded resolution.
class OcclusionPass {
 public:
  static Result<OcclusionPass> create(const QualitySettings& settings);
  void draw(const Canvas& canvas);

 private:
  Program half_depth_, occlusion_, blur_;
};

}  // namespace viscera
