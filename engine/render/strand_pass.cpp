#include <epoxy/gl.h>

#include "engine/render/shaders.h"
#include "engine/render/shading_passes.h"

namespace viscera {

Result<StrandPass> StrandPass::create() {
  StrandPass pass;
  ProgramLoader load;
  load(pass.program_, "strand.vert", "strand.frag", {}, {"open.glsl"});
  return load.give(std::move(pass));
}

void StrandPass::draw(const FrameView& view, const SceneBuffers& buffers, const Canvas& canvas) {
  if (view.beds.empty()) return;
  canvas.shade_seen(program_);
  for (const BedView& bed : view.beds) buffers.beds.at(bed.id).draw();
  glDisable(GL_DEPTH_TEST);
}

}  // namespace viscera
