#include "engine/render/smoke_march.h"

#include <epoxy/gl.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "engine/render/shader_layout.h"
#include "engine/render/shaders.h"

namespace viscera {
namespace {

constexpr int kColumnsPerLight = 3;   // of the lens's grid for one of the guide's
constexpr float kLightMargin = 1.3f;  // the guide beside the lens must see all that the lens sees
constexpr double kFarthest = 2.0;     // [m]
constexpr double kBackgroundDepth =
    0.3;  // marched where smoke fills the cavity; beyond, it dims alone [m]
constexpr double kSampleDistance = 0.75;  // along the view axis, over the cells' edge
constexpr int kMostSamples = 8;           // of the density in a slice
constexpr double kSliceStep = 5e-3;  // to which their range is rounded, so that it seldom moves [m]

Eigen::Vector3f optics_of(const SmokeOptics& optics) {
  return (optics.mass_extinction * Vec3(1.0, optics.albedo, optics.albedo * optics.asymmetry))
      .cast<float>();
}

Eigen::Vector2f tangents_of(const FrameView& view, const Canvas& canvas) {
  const double up = std::tan(0.5 * view.camera.field_of_view);
  return Eigen::Vector2d(up * canvas.width / canvas.height, up).cast<float>();
}

void dispatch(Program& program, const Texture& grid) {
  program.use();
  glDispatchCompute(static_cast<GLuint>((grid.width() + kMarchGroup - 1) / kMarchGroup),
                    static_cast<GLuint>((grid.height() + kMarchGroup - 1) / kMarchGroup), 1);
  glMemoryBarrier(GL_TEXTURE_FETCH_BARRIER_BIT);
}

void ensure_grid(Texture& texture, unsigned format, int width, int height, int depth) {
  if (texture.width() != width || texture.height() != height || texture.depth() != depth)
    texture = Texture(format, width, height, depth);
}

}  // namespace

int SmokeMarch::samples_in_slice(const FrameView& view,
                                 const std::vector<std::size_t>& volumes) const {
  const double step = (slices_.y() - slices_.x()) / static_cast<double>(slice_count_);
  double cell = 1.0;
  for (const std::size_t v : volumes) {
    const SmokeView& smoke = view.smoke[v];
    cell = std::min(cell, smoke.domain.sizes().cwiseQuotient(smoke.size.cast<double>()).minCoeff());
  }
  return std::clamp(static_cast<int>(std::ceil(step / (kSampleDistance * cell))), 1, kMostSamples);
}

Result<SmokeMarch> SmokeMarch::create(const QualitySettings& settings) {
  SmokeMarch march;
  march.columns_ = settings.smoke_columns;
  march.slice_count_ = settings.smoke_slices;
  // Compiled now, so that a mistake in the shaders shows before a long simulation.
  if (auto plain = march.programs_for(1, false); !plain) return std::unexpected(plain.error());
  return march;
}

Result<SmokeMarch::Programs*> SmokeMarch::programs_for(std::size_t volumes, bool with_temperature) {
  const auto key = std::pair(volumes, with_temperature);
  if (const auto found = programs_.find(key); found != programs_.end()) return &found->second;
  std::vector<std::string> definitions = {"VOLUMES " + std::to_string(volumes)};
  if (with_temperature) definitions.emplace_back("TEMPERATURE");
  Result<Program> light = load_compute("smoke_light.comp", definitions, {"smoke_medium.glsl"});
  if (!light) return std::unexpected(light.error());
  Result<Program> march = load_compute("smoke_march.comp", definitions, {"smoke_medium.glsl"});
  if (!march) return std::unexpected(march.error());
  return &programs_.emplace(key, Programs{*std::move(light), *std::move(march)}).first->second;
}

Eigen::Vector2f SmokeMarch::find_slices(const FrameView& view, const SceneBuffers& buffers,
                                        const std::vector<std::size_t>& volumes) const {
  const double up = std::tan(0.5 * view.camera.field_of_view);
  const double across = up * 16.0 / 9.0 * 2.0;  // generous: only whole bricks beside the picture go
  const Eigen::Matrix3d turn = view_matrix(view.camera).block<3, 3>(0, 0).cast<double>();
  double near = kFarthest, far = 0.0;
  for (const std::size_t v : volumes) {
    for (const Box& brick : buffers.smoke[v].bricks()) {
      const Vec3 centre = turn * (brick.center() - view.camera.position);
      const Vec3 reach = turn.cwiseAbs() * (0.5 * brick.sizes());
      const double nearest = -centre.z() - reach.z(), farthest = -centre.z() + reach.z();
      if (farthest <= 0.0 || std::abs(centre.x()) - reach.x() > across * farthest ||
          std::abs(centre.y()) - reach.y() > up * farthest)
        continue;
      near = std::min(near, nearest);
      far = std::max(far, farthest);
    }
  }
  if (background_.x() > 0.0f) {
    near = 0.0;
    far = std::max(far, kBackgroundDepth);
  }
  near = std::max(0.0, kSliceStep * std::floor(near / kSliceStep));
  far = std::min(kFarthest, kSliceStep * std::ceil(far / kSliceStep));
  return Eigen::Vector2d(near, far).cast<float>();
}

void SmokeMarch::set_medium(Program& program, const FrameView& view, const SceneBuffers& buffers,
                            const std::vector<std::size_t>& volumes) {
  program.set("view_to_world",
              Eigen::Matrix3f(view_matrix(view.camera).block<3, 3>(0, 0).transpose()));
  program.set("slices", slices_);
  program.set("background", background_);
  for (std::size_t i = 0; i < std::max<std::size_t>(1, volumes.size()); ++i) {
    const std::string index = "[" + std::to_string(i) + "]";
    const std::string volume = "volumes" + index + ".";
    const int unit = kFirstSmokeUnit + static_cast<int>(i);
    program.set(("density_maps" + index).c_str(), unit);
    const auto set = [&](const char* name, const Vec3& value) {
      program.set((volume + name).c_str(), Eigen::Vector3f(value.cast<float>()));
    };
    if (volumes.empty()) {
      // The background alone: a volume out of sight.
      set("filled_low", Vec3::Constant(1e6));
      set("filled_high", Vec3::Constant(1e6));
      continue;
    }
    const SmokeView& smoke = view.smoke[volumes[i]];
    const SmokeTexture& texture = buffers.smoke[volumes[i]];
    texture.density().bind(static_cast<unsigned>(unit));
    set("low", smoke.domain.min());
    set("size", smoke.domain.sizes());
    set("filled_low", texture.filled().min());
    set("filled_high", texture.filled().max());
    program.set((volume + "optics").c_str(), optics_of(smoke.optics));
  }
}

Result<bool> SmokeMarch::march(const FrameView& view, const SceneBuffers& buffers,
                               const Canvas& canvas, bool with_temperature) {
  std::vector<std::size_t> volumes;
  background_.setZero();
  for (std::size_t i = 0; i < view.smoke.size(); ++i) {
    const SmokeView& smoke = view.smoke[i];
    background_ += static_cast<float>(smoke.background) * optics_of(smoke.optics);
    if (smoke.look == SmokeView::Look::kMarch && !buffers.smoke[i].empty()) volumes.push_back(i);
  }
  if (volumes.size() > kMostSmokeVolumes) {
    return failure("smoke: found " + std::to_string(volumes.size()) +
                   " volumes with smoke, expected at most " + std::to_string(kMostSmokeVolumes));
  }
  slices_ = find_slices(view, buffers, volumes);
  if (slices_.y() <= slices_.x()) return false;
  auto found = programs_for(std::max<std::size_t>(1, volumes.size()), with_temperature);
  if (!found) return std::unexpected(found.error());
  Programs& programs = **found;

  const int rows = std::max(1, columns_ * canvas.height / canvas.width);
  const int light_columns = std::max(1, columns_ / kColumnsPerLight);
  const int light_rows = std::max(1, rows / kColumnsPerLight);
  ensure_grid(light_, GL_RG32F, light_columns, light_rows, slice_count_ + 1);
  ensure_grid(marched_, GL_RGBA32F, columns_, rows, slice_count_ + 1);
  light_tangents_ = kLightMargin * tangents_of(view, canvas);
  set_medium(programs.light, view, buffers, volumes);
  programs.light.set("light_tangents", light_tangents_);
  glBindImageTexture(0, light_.id(), 0, GL_TRUE, 0, GL_WRITE_ONLY, GL_RG32F);
  dispatch(programs.light, light_);

  set_medium(programs.march, view, buffers, volumes);
  programs.march.set("light_tangents", light_tangents_);
  programs.march.set("samples", samples_in_slice(view, volumes));
  light_.bind(kSmokeLightUnit);
  programs.march.set("light_map", kSmokeLightUnit);
  glBindImageTexture(0, marched_.id(), 0, GL_TRUE, 0, GL_WRITE_ONLY, GL_RGBA32F);
  if (with_temperature) {
    ensure_grid(heated_, GL_RG32F, columns_, rows, slice_count_ + 1);
    glBindImageTexture(1, heated_.id(), 0, GL_TRUE, 0, GL_WRITE_ONLY, GL_RG32F);
  }
  dispatch(programs.march, marched_);
  return true;
}

void SmokeMarch::bind(Program& program) const {
  marched_.bind(kSmokeUnit);
  program.set("marched_map", kSmokeUnit);
  light_.bind(kSmokeLightUnit);
  program.set("light_map", kSmokeLightUnit);
  program.set("light_tangents", light_tangents_);
  if (heated_) heated_.bind(kFirstSmokeUnit);
  program.set("heated_map", kFirstSmokeUnit);
  program.set("slices", slices_);
  program.set("background", background_);
}

}  // namespace viscera
