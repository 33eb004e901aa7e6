#include <epoxy/gl.h>

#include "engine/render/shaders.h"
#include "engine/render/shading_passes.h"

namespace viscera {

Result<InstrumentPass> InstrumentPass::create() {
  InstrumentPass pass;
  ProgramLoader load;
  load(pass.program_, "instrument.vert", "instrument.frag", {}, {"open.glsl"});
  return load.give(std::move(pass));
}

void InstrumentPass::draw(const FrameView& view, const SceneBuffers& buffers,
                          const Canvas& canvas) {
  if (view.instruments.empty()) return;
  canvas.shade_seen(program_);
  for (const InstrumentView& instrument : view.instruments) {
    program_.set("model", model_matrix(instrument));
    buffers.instruments.at(instrument.id).draw();
  }
  glDisable(GL_DEPTH_TEST);
}

}  // namespace viscera
