#include <epoxy/gl.h>

#include <cmath>

#include "engine/render/shaders.h"
#include "engine/render/shading_passes.h"
#include "engine/render/vessel_pattern.h"

namespace viscera {
namespace {

constexpr float kBackground[4] = {0.004f, 0.0016f, 0.0012f, 1.0f};
constexpr int kVesselEdge = 512;  // texels
/// Trunks of the vessel pattern across its square.
constexpr double kTrunks = 3.0;

Eigen::Vector3f colour(const Vec3& linear) {
  return linear.cast<float>();
}

void set_look(Program& program, const TissueLook& look) {
  program.set("colour", colour(look.colour));
  program.set("mottle_colour", colour(look.mottle_colour));
  program.set("artery_colour", colour(look.vessel_colour));
  program.set("vein_colour", colour(look.vein_colour));
  program.set("mottle_scale", static_cast<float>(look.mottle_scale));
  program.set("mottle_amount", static_cast<float>(look.mottle_amount));
  program.set("vessel_scale", static_cast<float>(kTrunks * look.vessel_scale));
  program.set("vessel_amount", static_cast<float>(look.vessel_amount));
  program.set("fat_amount", static_cast<float>(look.fat_amount));
  program.set("bump_height", static_cast<float>(look.bump_height));
  program.set("bump_scale", static_cast<float>(look.bump_scale));
  program.set("roughness", static_cast<float>(look.roughness));
  program.set("wetness", static_cast<float>(look.wetness));
  program.set("translucency", static_cast<float>(look.translucency));
}

}  // namespace

Result<OrganPass> OrganPass::create(const QualitySettings& settings) {
  OrganPass pass;
  pass.fine_relief_ = settings.fine_relief;
  // Compiled now, so that a mistake in the shader shows before a long simulation.
  if (auto plain = pass.program_for(TissueLook{}, false); !plain)
    return std::unexpected(plain.error());
  return pass;
}

Result<Program*> OrganPass::program_for(const TissueLook& look, bool burnt) {
  std::vector<std::string> definitions;
  if (look.pattern == TissueLook::Pattern::kLobules) definitions.emplace_back("LOBULES");
  if (look.pattern == TissueLook::Pattern::kFibres) definitions.emplace_back("FIBRES");
  if (look.vessel_amount > 0.0) definitions.emplace_back("VESSELS");
  if (look.fat_amount > 0.0) definitions.emplace_back("FAT");
  if (fine_relief_) definitions.emplace_back("FINE_RELIEF");
  if (burnt) definitions.emplace_back("BURNT");
  const auto found = programs_.find(definitions);
  if (found != programs_.end()) return &found->second;
  Result<Program> loaded = load_program("organ.vert", "organ.frag", definitions,
                                        {"open.glsl", "burn.glsl", "tissue.glsl"});
  if (!loaded) return std::unexpected(loaded.error());
  return &programs_.emplace(std::move(definitions), *std::move(loaded)).first->second;
}

Result<void> OrganPass::draw(const FrameView& view, const SceneBuffers& buffers,
                             const Canvas& canvas) {
  canvas.scene.bind();
  glClearBufferfv(GL_COLOR, 0, kBackground);
  for (const OrganView& organ : view.organs) {
    const OrganBuffers& surface = buffers.organs.at(organ.id);
    const bool burnt = organ.burn != nullptr && surface.burn() != nullptr;
    Result<Program*> found = program_for(organ.look, burnt);
    if (!found) return std::unexpected(found.error());
    Program& program = **found;
    if (organ.look.vessel_amount > 0.0 && !vessels_) {
      const VesselPattern pattern = grow_vessels(kVesselEdge);
      vessels_ = Texture::pattern(pattern.edge, pattern.edge, pattern.coverage.data());
    }
    if (vessels_) vessels_.bind(kVesselUnit);
    canvas.shade_seen(program);
    program.set("model", model_matrix(organ.pose));
    program.set("rotation",
                Eigen::Matrix3f(organ.pose.orientation.toRotationMatrix().cast<float>()));
    program.set("vessel_map", kVesselUnit);
    const float id = static_cast<float>(organ.id % 1024);
    program.set("seed_offset",
                Eigen::Vector3f(std::fmod(0.317f * id, 1.0f), std::fmod(0.571f * id, 1.0f),
                                std::fmod(0.739f * id, 1.0f)));
    set_look(program, organ.look);
    if (burnt) surface.burn()->bind(program, kBrickMapUnit, kAtlasUnit);
    surface.draw(canvas, organ.pose);
  }
  glDisable(GL_DEPTH_TEST);
  return {};
}

}  // namespace viscera
