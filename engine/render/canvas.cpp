#include "engine/render/canvas.h"

#include <epoxy/gl.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "engine/render/shader_layout.h"

namespace viscera {
namespace {

constexpr float kNear = 2e-3f, kFar = 2.0f;  // [m]
// A round picture a bit taller than the frame, as camera heads show it.
constexpr float kMaskRadius = 0.53f;  // of the height
constexpr float kNoMask = 10.0f;

/// Depth 0 at the near plane, 1 at the far one.
Eigen::Matrix4f projection_matrix(float tangent_x, float tangent_y) {
  Eigen::Matrix4f projection = Eigen::Matrix4f::Zero();
  projection(0, 0) = 1.0f / tangent_x;
  projection(1, 1) = 1.0f / tangent_y;
  projection(2, 2) = -kFar / (kFar - kNear);
  projection(2, 3) = -kFar * kNear / (kFar - kNear);
  projection(3, 2) = -1.0f;
  return projection;
}

int scaled(int pixels, float scale) {
  return std::max(1, static_cast<int>(std::lround(static_cast<float>(pixels) * scale)));
}

}  // namespace

Eigen::Matrix4f view_matrix(const CameraView& camera) {
  const Vec3 forward = camera.forward.normalized();
  const Vec3 right = forward.cross(camera.up).normalized();
  Eigen::Matrix4d view = Eigen::Matrix4d::Identity();
  view.block<1, 3>(0, 0) = right.transpose();
  view.block<1, 3>(1, 0) = right.cross(forward).transpose();
  view.block<1, 3>(2, 0) = -forward.transpose();
  view.block<3, 1>(0, 3) = -view.block<3, 3>(0, 0) * camera.position;
  return view.cast<float>();
}

Canvas::Canvas(int picture_width, int picture_height, Quality quality)
    : settings(settings_of(quality)), width(picture_width), height(picture_height) {
  const int shaded_width = scaled(width, settings.scale);
  const int shaded_height = scaled(height, settings.scale);
  const int half_width = (shaded_width + 1) / 2, half_height = (shaded_height + 1) / 2;
  const int quarter_width = (width + 3) / 4, quarter_height = (height + 3) / 4;
  constexpr auto kNearest = Texture::Filter::kNearest;
  radiance = Texture(GL_RGBA16F, shaded_width, shaded_height);
  depth = Texture(GL_DEPTH_COMPONENT32F, shaded_width, shaded_height, 0, kNearest);
  depth_only = Framebuffer({}, &depth);
  scene = Framebuffer({&radiance}, &depth);
  lit = Framebuffer({&radiance}, nullptr);
  distance = Layer(GL_R32F, half_width, half_height, kNearest);
  open_rough = Layer(GL_RG8, half_width, half_height, kNearest);
  open = Layer(GL_RG8, half_width, half_height);
  smoke = Layer(GL_RGBA16F, half_width, half_height, kNearest);
  small = Layer(GL_RGBA16F, quarter_width, quarter_height);
  spill_a = Layer(GL_RGBA16F, quarter_width, quarter_height);
  spill_b = Layer(GL_RGBA16F, quarter_width, quarter_height);
  exposure = Layer(GL_R32F, 1, 1, kNearest);
  developed = Layer(GL_RGBA8, width, height);
  shown = Layer(GL_RGBA8, width, height);
}

bool Canvas::complete() const {
  for (const Framebuffer* target :
       {&depth_only, &scene, &distance.target, &open_rough.target, &open.target, &lit,
        &smoke.target, &small.target, &spill_a.target, &spill_b.target, &exposure.target,
        &developed.target, &shown.target}) {
    if (!target->complete()) return false;
  }
  return true;
}

void Canvas::begin(const FrameView& view) {
  const float aspect = static_cast<float>(width) / static_cast<float>(height);
  const float tangent = static_cast<float>(std::tan(0.5 * view.camera.field_of_view));
  round_ = view.camera.round_mask;
  FrameBlock block;
  block.view = view_matrix(view.camera);
  block.projection = projection_matrix(tangent * aspect, tangent);
  clip_from_world_ = block.projection * block.view;
  block.eye << view.camera.position.cast<float>(), static_cast<float>(view.camera.barrel);
  block.light << (view.light_intensity * view.light_colour).cast<float>(), 0.0f;
  block.lens << tangent * aspect, tangent, kNear, kFar;
  block.picture << static_cast<float>(radiance.width()), static_cast<float>(radiance.height()),
      static_cast<float>(view.frame % 4096), round_ ? kMaskRadius : kNoMask;
  block.shown << static_cast<float>(width), static_cast<float>(height),
      static_cast<float>(view.camera.exposure), view.camera.automatic_exposure ? 1.0f : 0.0f;
  frame_block_.upload(std::span<const FrameBlock>(&block, 1));
  glBindBufferBase(GL_UNIFORM_BUFFER, 0, frame_block_.id());
}

bool Canvas::may_show(const Box& box, const Pose& pose) const {
  if (box.isEmpty()) return false;
  // Corners that lie beyond each side of the picture, and behind the lens.
  std::array<int, 5> beyond{};
  for (int i = 0; i < 8; ++i) {
    const Vec3 corner = pose.to_world(box.corner(static_cast<Box::CornerType>(i)));
    const Eigen::Vector4f clip = clip_from_world_ * corner.cast<float>().homogeneous();
    beyond[0] += clip.x() > clip.w();
    beyond[1] += clip.x() < -clip.w();
    beyond[2] += clip.y() > clip.w();
    beyond[3] += clip.y() < -clip.w();
    beyond[4] += clip.w() < kNear;
  }
  return std::ranges::find(beyond, 8) == beyond.end();
}

void Canvas::shade_seen(Program& program) const {
  scene.bind();
  glEnable(GL_DEPTH_TEST);
  glDepthFunc(GL_EQUAL);
  program.use();
  program.set("open_map", kOpenUnit);
  program.set("distance_map", kDistanceUnit);
}

void Canvas::full_screen(Program& program, const Framebuffer& target, const float* outside) const {
  target.bind();
  if (outside != nullptr) glClearBufferfv(GL_COLOR, 0, outside);
  program.use();
  glBindVertexArray(no_attributes_.id());
  if (round_) {
    glDrawArrays(GL_TRIANGLE_FAN, 0, kRimCorners + 2);
  } else {
    glDrawArrays(GL_TRIANGLES, 0, 3);
  }
}

}  // namespace viscera
