#include <epoxy/gl.h>

#include "engine/render/shaders.h"
#include "engine/render/shading_passes.h"

namespace viscera {

Result<StrandPass> StrandPass::create() {
  StrandPass pass;
  Result<Program> program = load_program("strand.vert", "strand.frag", {}, {"open.glsl"});
  if (!program) return std::unexpected(program.error());
  pass.program_ = *std::move(program);
  return pass;
}

void StrandPass::draw(const FrameView& view, const SceneBuffers& buffers, const Canvas& canvas) {
  if (view.beds.empty()) return;
  canvas.scene.bind();
  glEnable(GL_DEPTH_TEST);
  glDepthFunc(GL_EQUAL);
  program_.use();
  program_.set("open_map", kOpenUnit);
  program_.set("distance_map", kDistanceUnit);
  for (const BedView& bed : view.beds) buffers.beds.at(bed.id).draw();
  glDisable(GL_DEPTH_TEST);
}

}  // namespace viscera
