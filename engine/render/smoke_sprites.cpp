#include "engine/render/smoke_sprites.h"

#include <epoxy/gl.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numeric>
#include <string>

#include "engine/render/shaders.h"

namespace viscera {
namespace {

constexpr int kPuffEdge = 32;  // texels
constexpr float kClear[4] = {0.0f, 0.0f, 0.0f, 1.0f};

/// A round puff with a few lumps, its mean 1.
std::vector<float> puff_texels() {
  std::vector<float> texels;
  for (int y = 0; y < kPuffEdge; ++y) {
    for (int x = 0; x < kPuffEdge; ++x) {
      const double u = 2.0 * (x + 0.5) / kPuffEdge - 1.0, v = 2.0 * (y + 0.5) / kPuffEdge - 1.0;
      const double inside = std::max(0.0, 1.0 - u * u - v * v);
      const double lumps = std::sin(5.3 * u + 2.1 * v + 0.4) * std::sin(4.7 * v - 3.3 * u + 1.9) +
                           0.5 * std::sin(9.1 * u - 6.2 * v) * std::sin(8.3 * v + 5.9 * u + 0.7);
      texels.push_back(static_cast<float>(inside * inside * (1.0 + 0.45 * lumps)));
    }
  }
  const float mean =
      std::accumulate(texels.begin(), texels.end(), 0.0f) / static_cast<float>(texels.size());
  for (float& texel : texels) texel /= mean;
  return texels;
}

}  // namespace

Result<SmokeSprites> SmokeSprites::create() {
  SmokeSprites sprites;
  Result<Program> program = load_program("smoke_sprite.vert", "smoke_sprite.frag");
  if (!program) return std::unexpected(program.error());
  sprites.program_ = *std::move(program);
  sprites.array_.attribute(0, sprites.buffer_, 4, sizeof(Sprite));
  sprites.array_.attribute(1, sprites.buffer_, 1, sizeof(Sprite), offsetof(Sprite, mass));
  for (unsigned location = 0; location < 2; ++location)
    glVertexArrayBindingDivisor(sprites.array_.id(), location, 1);
  return sprites;
}

Result<bool> SmokeSprites::draw(const FrameView& view, const Canvas& canvas) {
  sprites_.clear();
  SmokeOptics optics;
  for (const SmokeView& smoke : view.smoke) {
    if (smoke.look != SmokeView::Look::kSprites) continue;
    const std::size_t count = smoke.particles.size();
    if (smoke.particle_radii.size() != count || smoke.particle_masses.size() != count) {
      return failure("smoke volume: " + std::to_string(smoke.particle_radii.size()) +
                     " radii and " + std::to_string(smoke.particle_masses.size()) +
                     " masses, expected one of each for each of " + std::to_string(count) +
                     " particles");
    }
    optics = smoke.optics;
    const Vec3f corner = smoke.domain.min().cast<float>();
    for (std::size_t i = 0; i < count; ++i) {
      const Vec3f at = corner + smoke.particles[i];
      sprites_.push_back(
          {at.x(), at.y(), at.z(), smoke.particle_radii[i], smoke.particle_masses[i]});
    }
  }
  if (sprites_.empty()) return false;
  const Vec3f forward = view.camera.forward.cast<float>();
  const auto axial = [&](const Sprite& one) { return forward.dot(Vec3f(one.x, one.y, one.z)); };
  std::stable_sort(sprites_.begin(), sprites_.end(),
                   [&](const Sprite& a, const Sprite& b) { return axial(a) > axial(b); });
  buffer_.upload(std::span<const Sprite>(sprites_));
  if (!puff_) {
    puff_ = Texture(GL_R32F, kPuffEdge, kPuffEdge);
    glTextureSubImage2D(puff_.id(), 0, 0, 0, kPuffEdge, kPuffEdge, GL_RED, GL_FLOAT,
                        puff_texels().data());
  }
  canvas.smoke.target.bind();
  glClearBufferfv(GL_COLOR, 0, kClear);
  glEnable(GL_BLEND);
  glBlendFuncSeparate(GL_ONE, GL_SRC_ALPHA, GL_ZERO, GL_SRC_ALPHA);
  puff_.bind(kSmokeUnit);
  program_.use();
  program_.set("puff_map", kSmokeUnit);
  program_.set("distance_map", kDistanceUnit);
  program_.set("mass_extinction", static_cast<float>(optics.mass_extinction));
  program_.set("albedo", static_cast<float>(optics.albedo));
  program_.set("asymmetry", static_cast<float>(optics.asymmetry));
  glBindVertexArray(array_.id());
  glDrawArraysInstanced(GL_TRIANGLE_STRIP, 0, 4, static_cast<GLsizei>(sprites_.size()));
  glDisable(GL_BLEND);
  return true;
}

}  // namespace viscera
