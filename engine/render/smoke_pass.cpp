#include <epoxy/gl.h>

#include <algorithm>

#include "engine/render/shaders.h"
#include "engine/render/shading_passes.h"

namespace viscera {
namespace {

constexpr float kNoSmoke[4] = {0.0f, 0.0f, 0.0f, 1.0f};

}  // namespace

Result<SmokePass> SmokePass::create(const QualitySettings& settings) {
  SmokePass pass;
  ProgramLoader load;
  load(pass.march_, "full_screen.vert", "smoke.frag",
       {"STEPS " + std::to_string(settings.smoke_steps)});
  load(pass.blur_, "full_screen.vert", "smoke_blur.frag");
  return load.give(std::move(pass));
}

bool SmokePass::draw(const FrameView& view, const SceneBuffers& buffers, const Canvas& canvas) {
  const std::vector<SmokeTexture>& smoke = buffers.smoke;
  std::vector<std::size_t> order;
  for (std::size_t i = 0; i < smoke.size(); ++i) {
    if (!smoke[i].empty()) order.push_back(i);
  }
  if (order.empty()) return false;
  // Far to near: each volume dims what lies behind it, and adds its own.
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    const double far_a = smoke[a].filled().squaredExteriorDistance(view.camera.position);
    const double far_b = smoke[b].filled().squaredExteriorDistance(view.camera.position);
    return far_a != far_b ? far_a > far_b : a < b;
  });
  canvas.smoke_rough.target.bind();
  glClearBufferfv(GL_COLOR, 0, kNoSmoke);
  glEnable(GL_BLEND);
  glBlendFuncSeparate(GL_ONE, GL_SRC_ALPHA, GL_ZERO, GL_SRC_ALPHA);
  march_.set("density_map", kDensityUnit);
  march_.set("distance_map", kDistanceUnit);
  march_.set("view_to_world",
             Eigen::Matrix3f(view_matrix(view.camera).block<3, 3>(0, 0).transpose()));
  for (const std::size_t i : order) {
    const SmokeView& volume = view.smoke[i];
    smoke[i].density().bind(kDensityUnit);
    march_.set("domain_low", Eigen::Vector3f(volume.domain.min().cast<float>()));
    march_.set("domain_size", Eigen::Vector3f(volume.domain.sizes().cast<float>()));
    march_.set("filled_low", Eigen::Vector3f(smoke[i].filled().min().cast<float>()));
    march_.set("filled_high", Eigen::Vector3f(smoke[i].filled().max().cast<float>()));
    march_.set("mass_extinction", static_cast<float>(volume.mass_extinction));
    march_.set("albedo", static_cast<float>(volume.albedo));
    march_.set("asymmetry", static_cast<float>(volume.asymmetry));
    canvas.full_screen(march_, canvas.smoke_rough.target, nullptr);
  }
  glDisable(GL_BLEND);
  canvas.smoke_rough.texture.bind(kSmokeUnit);
  blur_.set("smoke_map", kSmokeUnit);
  blur_.set("distance_map", kDistanceUnit);
  canvas.full_screen(blur_, canvas.smoke.target, kNoSmoke);
  canvas.smoke.texture.bind(kSmokeUnit);
  return true;
}

}  // namespace viscera
