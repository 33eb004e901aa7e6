// Draws what a picture's ground truth needs besides the picture, and reads it back.
#pragma once

#include "engine/render/canvas.h"
#include "engine/render/pass_images.h"
#include "engine/render/scene_buffers.h"
#include "kernels/base/result.h"

namespace viscera {

/// Where passes are drawn, at the shaded resolution.
class PassLayers {
 public:
  explicit PassLayers(const Canvas& canvas);
  bool complete() const { return light.complete() && surface.complete(); }

  /// As without smoke; what full-screen passes don't cover stays so.
  void clear_light() const;
  /// Reads everything but `clean` back; the canvas's radiance has smoke by then.
  void read_back(const Canvas& canvas, PassImages& images) const;
  /// Reads `clean`: the canvas's radiance before smoke.
  static void read_clean(const Canvas& canvas, PassImages& images);

 private:
  Texture kept_, scattered_, label_, temperature_;

 public:
  Framebuffer light;    ///< smoke.frag's with PASSES
  Framebuffer surface;  ///< label.frag's, with the canvas's depth
};

/// Number and temperature of what each pixel shows.
class LabelPass {
 public:
  static Result<LabelPass> create();
  void draw(const FrameView& view, const SceneBuffers& buffers, const Canvas& canvas,
            const PassLayers& layers);

 private:
  Program organ_, burnt_organ_, instrument_, strand_;
};

}  // namespace viscera
