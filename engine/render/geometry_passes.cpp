#include "engine/render/geometry_passes.h"

#include <epoxy/gl.h>

#include "engine/render/shaders.h"

namespace viscera {
namespace {

// What full-screen passes leave outside the field of view, so that no old picture shines in.
constexpr float kOpen[4] = {1.0f, 1.0f, 1.0f, 1.0f};
constexpr float kNowhere[4] = {-1.0f, 0.0f, 0.0f, 0.0f};

}  // namespace

Result<DepthPass> DepthPass::create() {
  DepthPass pass;
  ProgramLoader load;
  load(pass.field_, "full_screen.vert", "depth.frag");
  load(pass.organ_, "organ.vert", "depth.frag");
  load(pass.instrument_, "instrument.vert", "depth.frag");
  load(pass.strand_, "strand.vert", "depth.frag");
  return load.give(std::move(pass));
}

void DepthPass::draw(const FrameView& view, const SceneBuffers& buffers, const Canvas& canvas) {
  canvas.depth_only.bind();
  glDepthMask(GL_TRUE);
  // Depth 0 outside the field of view: nothing passes the test there.
  glClearDepth(0.0);
  glClear(GL_DEPTH_BUFFER_BIT);
  glEnable(GL_DEPTH_TEST);
  glDepthFunc(GL_ALWAYS);
  canvas.full_screen(field_, canvas.depth_only, nullptr);
  glDepthFunc(GL_LESS);
  organ_.use();
  for (const OrganView& organ : view.organs) {
    organ_.set("model", model_matrix(organ.pose));
    buffers.organs.at(organ.id).draw(canvas, organ.pose);
  }
  instrument_.use();
  for (const InstrumentView& instrument : view.instruments) {
    instrument_.set("model", model_matrix(instrument));
    buffers.instruments.at(instrument.id).draw();
  }
  strand_.use();
  for (const BedView& bed : view.beds) buffers.beds.at(bed.id).draw();
  glDepthMask(GL_FALSE);
  glDisable(GL_DEPTH_TEST);
}

Result<OcclusionPass> OcclusionPass::create(const QualitySettings& settings) {
  OcclusionPass pass;
  ProgramLoader load;
  load(pass.half_depth_, "full_screen.vert", "half_depth.frag");
  load(pass.occlusion_, "full_screen.vert", "occlusion.frag",
       {"SAMPLES " + std::to_string(settings.occlusion_samples),
        "SHADOW_STEPS " + std::to_string(settings.shadow_steps)});
  load(pass.blur_, "full_screen.vert", "occlusion_blur.frag");
  return load.give(std::move(pass));
}

void OcclusionPass::draw(const Canvas& canvas) {
  canvas.depth.bind(kDepthUnit);
  half_depth_.set("depth_map", kDepthUnit);
  canvas.full_screen(half_depth_, canvas.distance.target, kNowhere);
  canvas.distance.texture.bind(kDistanceUnit);
  occlusion_.set("distance_map", kDistanceUnit);
  canvas.full_screen(occlusion_, canvas.open_rough.target, kOpen);
  canvas.open_rough.texture.bind(kOpenUnit);
  blur_.set("distance_map", kDistanceUnit);
  blur_.set("open_map", kOpenUnit);
  canvas.full_screen(blur_, canvas.open.target, kOpen);
  canvas.open.texture.bind(kOpenUnit);
}

}  // namespace viscera
