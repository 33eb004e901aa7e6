#include <epoxy/gl.h>

#include "engine/render/shaders.h"
#include "engine/render/shading_passes.h"

namespace viscera {

Result<InstrumentPass> InstrumentPass::create() {
  InstrumentPass pass;
  Result<Program> program = load_program("instrument.vert", "instrument.frag", {}, {"open.glsl"});
  if (!program) return std::unexpected(program.error());
  pass.program_ = *std::move(program);
  return pass;
}

void InstrumentPass::draw(const FrameView& view, const SceneBuffers& buffers,
                          const Canvas& canvas) {
  if (view.instruments.empty()) return;
  canvas.scene.bind();
  glEnable(GL_DEPTH_TEST);
  glDepthFunc(GL_EQUAL);
  program_.use();
  program_.set("open_map", kOpenUnit);
  program_.set("distance_map", kDistanceUnit);
  for (const InstrumentView& instrument : view.instruments) {
    program_.set("model", model_matrix(instrument));
    buffers.instruments.at(instrument.id).draw();
  }
  glDisable(GL_DEPTH_TEST);
}

}  // namespace viscera
