// The colour of all that is seen, in linear light.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "engine/render/canvas.h"
#include "engine/render/scene_buffers.h"

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

/// Marches smoke volumes at half the shaded resolution.
class SmokePass {
 public:
  static Result<SmokePass> create(const QualitySettings& settings);
  /// False when there is no smoke to be seen.
  bool draw(const FrameView& view, const SceneBuffers& buffers, const Canvas& canvas);

 private:
  Program march_, blur_;
};

}  // namespace viscera
