// What all passes of a picture share: the frame's uniform block, the textures they draw into, and
// how a full-screen pass is drawn.
#pragma once

#include "engine/gpu/buffer.h"
#include "engine/gpu/program.h"
#include "engine/gpu/texture.h"
#include "engine/render/quality.h"
#include "engine/render/view.h"
#include "kernels/base/result.h"

namespace viscera {

/// Texture units, the same in every pass.
enum Unit {
  kRadianceUnit,
  kDepthUnit,
  kDistanceUnit,
  kOpenUnit,
  kSmokeUnit,
  kSpillUnit,
  kExposureUnit,
  kVesselUnit,
  kBrickMapUnit,
  kAtlasUnit,
  kSpriteUnit,
  kSmokeLightUnit,
  kFirstSmokeUnit  // one a volume from here on
};

/// A texture that passes write and later ones read.
struct Layer {
  Texture texture;
  Framebuffer target;

  Layer() = default;
  Layer(unsigned format, int width, int height, Texture::Filter filter = Texture::Filter::kLinear)
      : texture(format, width, height, 0, filter), target({&texture}, nullptr) {}
};

/// Owned by the renderer; passes get it for every picture.
class Canvas {
 public:
  Canvas(int width, int height, Quality quality);

  bool complete() const;
  /// Uploads the frame's block.
  void begin(const FrameView& view);
  /// Draws over the field of view. `outside`: colour of what isn't covered; null keeps what is
  /// there.
  void full_screen(Program& program, const Framebuffer& target, const float* outside) const;

  /// Before draws that shade what the depth pass has laid; their fragment shader has open.glsl.
  void shade_seen(Program& program) const;

  /// False when no point of the box (organ frame) can be in the picture.
  bool may_show(const Box& box, const Pose& pose) const;

  const QualitySettings settings;
  const int width, height;  ///< of the picture shown
  Texture radiance, depth;  ///< shaded resolution: `settings.scale` times the picture's
  Framebuffer depth_only, scene;
  Framebuffer lit;         ///< radiance alone: for passes that read the depth
  Layer distance;          ///< axial distance [m], half the shaded resolution
  Layer open_rough, open;  ///< r: ambient light that gets in, g: lens light that isn't shaded
  Layer smoke;             ///< half the shaded resolution
  Layer small, spill_a, spill_b;  ///< a quarter of the picture's
  Layer exposure;                 ///< one pixel
  Layer developed, shown;         ///< the picture's

 private:
  Buffer frame_block_;
  VertexArray no_attributes_;
  // Of the picture being drawn.
  bool round_ = true;
  Eigen::Matrix4f clip_from_world_ = Eigen::Matrix4f::Identity();
};

/// World to camera: x right, y up, z towards the viewer.
Eigen::Matrix4f view_matrix(const CameraView& camera);

}  // namespace viscera
