#include "engine/render/lens_pass.h"

#include "engine/render/shaders.h"

namespace viscera {
namespace {

constexpr float kBlack[4] = {0.0f, 0.0f, 0.0f, 0.0f};

}  // namespace

Result<LensPass> LensPass::create(const QualitySettings& settings) {
  LensPass pass;
  ProgramLoader load;
  load(pass.small_, "full_screen.vert", "small.frag");
  load(pass.meter_, "full_screen.vert", "meter.frag");
  load(pass.bright_, "full_screen.vert", "bright.frag");
  load(pass.blur_, "full_screen.vert", "blur.frag");
  std::vector<std::string> definitions;
  if (settings.scale > 1.0f) definitions.emplace_back("SUPERSAMPLED");
  load(pass.develop_, "full_screen.vert", "develop.frag", definitions);
  std::vector<std::string> show;
  if (settings.smooth_edges) show.emplace_back("STAIRS");
  load(pass.show_, "full_screen.vert", "show.frag", show);
  return load.give(std::move(pass));
}

void LensPass::meter(const Canvas& canvas) {
  canvas.radiance.bind(kRadianceUnit);
  small_.set("radiance_map", kRadianceUnit);
  canvas.full_screen(small_, canvas.small.target, kBlack);
  canvas.small.texture.bind(kSpillUnit);
  meter_.set("small_map", kSpillUnit);
  canvas.full_screen(meter_, canvas.exposure.target, nullptr);
  canvas.exposure.texture.bind(kExposureUnit);
  bright_.set("small_map", kSpillUnit);
  bright_.set("exposure_map", kExposureUnit);
  canvas.full_screen(bright_, canvas.spill_a.target, kBlack);
  blur_.set("source_map", kSpillUnit);
  canvas.spill_a.texture.bind(kSpillUnit);
  blur_.set("axis", Eigen::Vector2f(1.0f, 0.0f));
  canvas.full_screen(blur_, canvas.spill_b.target, kBlack);
  canvas.spill_b.texture.bind(kSpillUnit);
  blur_.set("axis", Eigen::Vector2f(0.0f, 1.0f));
  canvas.full_screen(blur_, canvas.spill_a.target, kBlack);
  canvas.spill_a.texture.bind(kSpillUnit);
}

void LensPass::develop(const Canvas& canvas) {
  develop_.set("radiance_map", kRadianceUnit);
  develop_.set("spill_map", kSpillUnit);
  develop_.set("exposure_map", kExposureUnit);
  canvas.full_screen(develop_, canvas.developed.target, kBlack);
  canvas.developed.texture.bind(kRadianceUnit);
  show_.set("developed_map", kRadianceUnit);
  canvas.full_screen(show_, canvas.shown.target, kBlack);
}

}  // namespace viscera
