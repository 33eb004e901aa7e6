// The colour of all that is seen, in linear light.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "engine/render/canvas.h"
#include "engine/render/passes.h"
#include "engine/render/scene_buffers.h"
#include "engine/render/smoke_march.h"
#include "engine/render/smoke_sprites.h"

namespace viscera {

/// Tissue. One program for each kind of pattern that the scene has, compiled when first needed.
class OrganPass {
 public:
  static Result<OrganPass> create(const QualitySettings& settings);
  Result<void> draw(const FrameView& view, const SceneBuffers& buffers, const Canvas& canvas);

 private:
  Result<Program*> program_for(const TissueLook& look, bool burnt);

  bool fine_relief_ = true;
  Texture vessels_;                                       // made with the first look that has any
  std::map<std::vector<std::string>, Program> programs_;  // by definitions
};

class InstrumentPass {
 public:
  static Result<InstrumentPass> create();
  void draw(const FrameView& view, const SceneBuffers& buffers, const Canvas& canvas);

 private:
  Program program_;
};

/// What beds' bonds look like.
class StrandPass {
 public:
  static Result<StrandPass> create();
  void draw(const FrameView& view, const SceneBuffers& buffers, const Canvas& canvas);

 private:
  Program program_;
};

/// Lays smoke over what has been drawn: marched through its density, or as the particles' sprites.
class SmokePass {
 public:
  static Result<SmokePass> create(const QualitySettings& settings);
  /// `layers`: null, or where what smoke does to light is written besides.
  Result<void> draw(const FrameView& view, const SceneBuffers& buffers, const Canvas& canvas,
                    const PassLayers* layers);

 private:
  struct Parts {
    bool marched = false, sprites = false, passes = false;
    auto operator<=>(const Parts&) const = default;
  };
  Result<Program*> program_for(const Parts& parts);
  Result<void> shade(const FrameView& view, const Canvas& canvas, bool passes,
                     const Framebuffer& target);

  SmokeMarch march_;
  SmokeSprites sprites_;
  std::map<Parts, Program> programs_;
  // Of the picture being drawn.
  bool marched_ = false, drew_sprites_ = false;
};

}  // namespace viscera
