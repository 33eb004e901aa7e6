#include <epoxy/gl.h>

#include "engine/render/shaders.h"
#include "engine/render/shading_passes.h"

namespace viscera {

Result<SmokePass> SmokePass::create(const QualitySettings& settings) {
  SmokePass pass;
  Result<SmokeMarch> march = SmokeMarch::create(settings);
  if (!march) return std::unexpected(march.error());
  pass.march_ = *std::move(march);
  Result<SmokeSprites> sprites = SmokeSprites::create();
  if (!sprites) return std::unexpected(sprites.error());
  pass.sprites_ = *std::move(sprites);
  if (auto plain = pass.program_for({.marched = true}); !plain)
    return std::unexpected(plain.error());
  return pass;
}

Result<Program*> SmokePass::program_for(const Parts& parts) {
  if (const auto found = programs_.find(parts); found != programs_.end()) return &found->second;
  std::vector<std::string> definitions;
  if (parts.marched) definitions.emplace_back("MARCHED");
  if (parts.sprites) definitions.emplace_back("SPRITES");
  if (parts.passes) definitions.emplace_back("PASSES");
  if (parts.passes) definitions.emplace_back("TEMPERATURE");
  Result<Program> loaded = load_program("full_screen.vert", "smoke.frag", definitions);
  if (!loaded) return std::unexpected(loaded.error());
  return &programs_.emplace(parts, *std::move(loaded)).first->second;
}

Result<void> SmokePass::shade(const FrameView& view, const Canvas& canvas, bool passes,
                              const Framebuffer& target) {
  const auto found = program_for({.marched = marched_, .sprites = drew_sprites_, .passes = passes});
  if (!found) return std::unexpected(found.error());
  Program& program = **found;
  program.set("depth_map", kDepthUnit);
  if (marched_) march_.bind(program);
  if (drew_sprites_) {
    canvas.smoke.texture.bind(kSpriteUnit);
    program.set("sprite_map", kSpriteUnit);
    program.set("distance_map", kDistanceUnit);
    const SmokeOptics& optics = view.smoke.front().optics;
    program.set("forward", static_cast<float>(optics.albedo * optics.asymmetry));
  }
  program.set("gas_temperature", static_cast<float>(view.gas_temperature));
  canvas.full_screen(program, target, nullptr);
  return {};
}

Result<void> SmokePass::draw(const FrameView& view, const SceneBuffers& buffers,
                             const Canvas& canvas, const PassLayers* layers) {
  Result<bool> marched = march_.march(view, buffers, canvas, layers != nullptr);
  if (!marched) return std::unexpected(marched.error());
  marched_ = *marched;
  Result<bool> drawn = sprites_.draw(view, canvas);
  if (!drawn) return std::unexpected(drawn.error());
  drew_sprites_ = *drawn;
  if (layers != nullptr) {
    layers->clear_light();
    if (auto done = shade(view, canvas, true, layers->light); !done) return done;
  }
  if (!marched_ && !drew_sprites_) return {};
  // What lies behind is dimmed in place: scattered + share left * what is there.
  glEnable(GL_BLEND);
  glBlendFuncSeparate(GL_ONE, GL_SRC_ALPHA, GL_ZERO, GL_ONE);
  const Result<void> done = shade(view, canvas, false, canvas.lit);
  glDisable(GL_BLEND);
  return done;
}

}  // namespace viscera
