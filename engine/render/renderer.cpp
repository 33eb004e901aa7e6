#include "engine/render/renderer.h"

#include <epoxy/gl.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <set>

#include "engine/gpu/buffer.h"
#include "engine/gpu/egl_context.h"
#include "engine/gpu/texture.h"
#include "engine/render/instrument_mesh.h"
#include "engine/render/organ_buffers.h"
#include "engine/render/shaders.h"
#include "engine/render/smoke_texture.h"

namespace viscera {

namespace {

constexpr float kNear = 2e-3f, kFar = 2.0f;  // [m]
// A round picture a bit taller than the frame, as camera heads show it.
constexpr float kMaskRadius = 0.53f;  // of the height
constexpr float kNoMask = 10.0f;
constexpr int kRim = 96;  // corners of the disc in full_screen.vert
// What full-screen passes leave outside the field of view, so that no old picture shines in.
constexpr float kBlack[4] = {0.0f, 0.0f, 0.0f, 0.0f};
constexpr float kOpen[4] = {1.0f, 1.0f, 1.0f, 1.0f};
constexpr float kNowhere[4] = {-1.0f, 0.0f, 0.0f, 0.0f};
constexpr float kNoSmoke[4] = {0.0f, 0.0f, 0.0f, 1.0f};
constexpr float kBackground[4] = {0.004f, 0.0016f, 0.0012f, 1.0f};

/// The std140 block Frame of frame.glsl.
struct FrameBlock {
  Eigen::Matrix4f view, projection;
  Eigen::Vector4f eye, light, lens, picture;
};
static_assert(sizeof(FrameBlock) == 192);
static_assert(offsetof(FrameBlock, eye) == 128 && offsetof(FrameBlock, picture) == 176);

// Texture units, the same in every pass.
enum Unit {
  kRadianceUnit,
  kDepthUnit,
  kDistanceUnit,
  kOpenUnit,
  kSmokeUnit,
  kDensityUnit,
  kSpillUnit,
  kBrickMapUnit,
  kAtlasUnit
};

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

Eigen::Matrix4f model_matrix(const Pose& pose) {
  Eigen::Matrix4d model = Eigen::Matrix4d::Identity();
  model.block<3, 3>(0, 0) = pose.orientation.toRotationMatrix();
  model.block<3, 1>(0, 3) = pose.position;
  return model.cast<float>();
}

Eigen::Matrix4f model_matrix(const InstrumentView& view) {
  const Vec3 along = view.shaft_direction.normalized();
  Vec3 side = view.side_direction - along * along.dot(view.side_direction);
  side = side.norm() > 1e-6 ? side.normalized() : along.unitOrthogonal();
  Eigen::Matrix4d model = Eigen::Matrix4d::Identity();
  model.block<3, 1>(0, 0) = side;
  model.block<3, 1>(0, 1) = along.cross(side);
  model.block<3, 1>(0, 2) = along;
  model.block<3, 1>(0, 3) = view.tip;
  return model.cast<float>();
}

struct InstrumentBuffers {
  Buffer vertices, elements;
  VertexArray array;
  GLsizei indices = 0;
  InstrumentView built;  // what the mesh was made from
  bool valid = false;

  void update(const InstrumentView& view) {
    const bool same = valid && built.kind == view.kind && built.mesh == view.mesh &&
                      built.shaft_radius == view.shaft_radius &&
                      built.shaft_length == view.shaft_length &&
                      built.tip_radius == view.tip_radius && built.jaw == view.jaw;
    if (same) return;
    const InstrumentMesh mesh = make_instrument(view);
    vertices.upload(std::span<const InstrumentVertex>(mesh.vertices));
    elements.upload(std::span<const std::uint32_t>(mesh.indices));
    constexpr std::size_t kStride = sizeof(InstrumentVertex);
    array.attribute(0, vertices, 3, kStride, offsetof(InstrumentVertex, position));
    array.attribute(1, vertices, 3, kStride, offsetof(InstrumentVertex, normal));
    array.attribute(2, vertices, 1, kStride, offsetof(InstrumentVertex, finish));
    array.elements(elements);
    indices = static_cast<GLsizei>(mesh.indices.size());
    built = view;
    valid = true;
  }

  void draw() const {
    glBindVertexArray(array.id());
    glDrawElements(GL_TRIANGLES, indices, GL_UNSIGNED_INT, nullptr);
  }
};

struct Programs {
  Program field, organ_depth, instrument_depth, half_depth, occlusion, occlusion_blur;
  Program organ, burnt_organ, instrument, smoke, smoke_blur, bright, blur, develop, develop_smoke,
      smooth;
};

Result<Programs> load_programs() {
  Programs programs;
  Error error;
  const auto load = [&error](Program& program, const char* vertex, const char* fragment,
                             const std::vector<std::string>& definitions = {}) {
    Result<Program> loaded = load_program(vertex, fragment, definitions);
    if (loaded) {
      program = *std::move(loaded);
    } else {
      error.messages.insert(error.messages.end(), loaded.error().messages.begin(),
                            loaded.error().messages.end());
    }
  };
  load(programs.field, "full_screen.vert", "depth.frag");
  load(programs.organ_depth, "organ.vert", "depth.frag");
  load(programs.instrument_depth, "instrument.vert", "depth.frag");
  load(programs.half_depth, "full_screen.vert", "half_depth.frag");
  load(programs.occlusion, "full_screen.vert", "occlusion.frag");
  load(programs.occlusion_blur, "full_screen.vert", "occlusion_blur.frag");
  load(programs.organ, "organ.vert", "organ.frag");
  load(programs.burnt_organ, "organ.vert", "organ.frag", {"BURNT"});
  load(programs.instrument, "instrument.vert", "instrument.frag");
  load(programs.smoke, "full_screen.vert", "smoke.frag");
  load(programs.smoke_blur, "full_screen.vert", "smoke_blur.frag");
  load(programs.bright, "full_screen.vert", "bright.frag");
  load(programs.blur, "full_screen.vert", "blur.frag");
  load(programs.develop, "full_screen.vert", "develop.frag");
  load(programs.develop_smoke, "full_screen.vert", "develop.frag", {"SMOKE"});
  load(programs.smooth, "full_screen.vert", "smooth.frag");
  if (!error.messages.empty()) return std::unexpected(error);
  return programs;
}

/// Everything that passes draw into.
struct Targets {
  Texture radiance, depth, distance, open_rough, open, smoke_rough, smoke, spill_a, spill_b,
      developed, shown;
  Framebuffer depth_only, distance_target, open_rough_target, open_target, scene;
  Framebuffer smoke_rough_target, smoke_target;
  Framebuffer spill_a_target, spill_b_target, developed_target, shown_target;

  Targets(int width, int height) {
    const int half_width = (width + 1) / 2, half_height = (height + 1) / 2;
    const int quarter_width = (width + 3) / 4, quarter_height = (height + 3) / 4;
    radiance = Texture(GL_RGBA16F, width, height);
    depth = Texture(GL_DEPTH_COMPONENT32F, width, height, 0, Texture::Filter::kNearest);
    distance = Texture(GL_R32F, half_width, half_height, 0, Texture::Filter::kNearest);
    open_rough = Texture(GL_R8, half_width, half_height, 0, Texture::Filter::kNearest);
    open = Texture(GL_R8, half_width, half_height);
    smoke_rough = Texture(GL_RGBA16F, half_width, half_height, 0, Texture::Filter::kNearest);
    smoke = Texture(GL_RGBA16F, half_width, half_height, 0, Texture::Filter::kNearest);
    spill_a = Texture(GL_RGBA16F, quarter_width, quarter_height);
    spill_b = Texture(GL_RGBA16F, quarter_width, quarter_height);
    developed = Texture(GL_RGBA8, width, height);
    shown = Texture(GL_RGBA8, width, height);
    depth_only = Framebuffer({}, &depth);
    distance_target = Framebuffer({&distance}, nullptr);
    open_rough_target = Framebuffer({&open_rough}, nullptr);
    open_target = Framebuffer({&open}, nullptr);
    scene = Framebuffer({&radiance}, &depth);
    smoke_rough_target = Framebuffer({&smoke_rough}, nullptr);
    smoke_target = Framebuffer({&smoke}, nullptr);
    spill_a_target = Framebuffer({&spill_a}, nullptr);
    spill_b_target = Framebuffer({&spill_b}, nullptr);
    developed_target = Framebuffer({&developed}, nullptr);
    shown_target = Framebuffer({&shown}, nullptr);
  }

  bool complete() const {
    for (const Framebuffer* target :
         {&depth_only, &distance_target, &open_rough_target, &open_target, &scene,
          &smoke_rough_target, &smoke_target, &spill_a_target, &spill_b_target, &developed_target,
          &shown_target}) {
      if (!target->complete()) return false;
    }
    return true;
  }
};

}  // namespace

struct Renderer::Data {
  // The context goes last: what follows it deletes its GL objects in it.
  std::unique_ptr<EglContext> context;
  RenderOptions options;
  Programs programs;
  std::optional<Targets> targets;
  std::optional<Buffer> frame_block;
  std::optional<VertexArray> no_attributes;
  std::map<std::uint32_t, OrganBuffers> organs;
  std::map<std::uint32_t, InstrumentBuffers> instruments;
  std::vector<SmokeTexture> smoke;
  std::optional<PassTimer> timer;
  std::vector<PassTime> pass_times;
  std::vector<std::uint8_t> rgba;
  bool round = true;  // of the picture being drawn

  ~Data() {
    if (context != nullptr) context->make_current();
  }

  void full_screen(Program& program, const Framebuffer& target, const float* outside);
  Result<void> update(const FrameView& view);
  void upload_frame(const FrameView& view);
  void lay_depth(const FrameView& view);
  void find_occlusion();
  void shade_organs(const FrameView& view);
  void shade_instruments(const FrameView& view);
  bool march_smoke(const FrameView& view);
  void spill_light();
  void develop(bool with_smoke);
  void read_back(Picture& picture);
};

/// `outside`: colour of what isn't covered; null keeps what is there.
void Renderer::Data::full_screen(Program& program, const Framebuffer& target,
                                 const float* outside) {
  target.bind();
  if (outside != nullptr) glClearBufferfv(GL_COLOR, 0, outside);
  program.use();
  glBindVertexArray(no_attributes->id());
  if (round) {
    glDrawArrays(GL_TRIANGLE_FAN, 0, kRim + 2);
  } else {
    glDrawArrays(GL_TRIANGLES, 0, 3);
  }
}

Result<void> Renderer::Data::update(const FrameView& view) {
  std::set<std::uint32_t> seen;
  for (const OrganView& organ : view.organs) {
    seen.insert(organ.id);
    if (Result<void> done = organs[organ.id].update(organ); !done) return done;
  }
  std::erase_if(organs, [&](const auto& entry) { return !seen.contains(entry.first); });
  seen.clear();
  for (const InstrumentView& instrument : view.instruments) {
    seen.insert(instrument.id);
    instruments[instrument.id].update(instrument);
  }
  std::erase_if(instruments, [&](const auto& entry) { return !seen.contains(entry.first); });
  smoke.resize(view.smoke.size());
  for (std::size_t i = 0; i < smoke.size(); ++i) {
    if (Result<void> done = smoke[i].update(view.smoke[i]); !done) return done;
  }
  return {};
}

void Renderer::Data::upload_frame(const FrameView& view) {
  const float width = static_cast<float>(options.width),
              height = static_cast<float>(options.height);
  const float tangent = static_cast<float>(std::tan(0.5 * view.camera.field_of_view));
  FrameBlock block;
  block.view = view_matrix(view.camera);
  block.projection = projection_matrix(tangent * width / height, tangent);
  round = view.camera.round_mask;
  block.eye << view.camera.position.cast<float>(), 1.0f;
  block.light << (view.light_intensity * view.light_colour).cast<float>(), 0.0f;
  block.lens << tangent * width / height, tangent, kNear, kFar;
  block.picture << width, height, static_cast<float>(view.frame % 4096),
      view.camera.round_mask ? kMaskRadius : kNoMask;
  frame_block->upload(std::span<const FrameBlock>(&block, 1));
  glBindBufferBase(GL_UNIFORM_BUFFER, 0, frame_block->id());
}

// What is seen is known before anything is shaded: tissue is costly, so each pixel is shaded once,
// and occlusion can look at the depth.
void Renderer::Data::lay_depth(const FrameView& view) {
  targets->depth_only.bind();
  glDepthMask(GL_TRUE);
  // Depth 0 outside the field of view: nothing passes the test there.
  glClearDepth(0.0);
  glClear(GL_DEPTH_BUFFER_BIT);
  glEnable(GL_DEPTH_TEST);
  glDepthFunc(GL_ALWAYS);
  full_screen(programs.field, targets->depth_only, nullptr);
  glDepthFunc(GL_LESS);
  programs.organ_depth.use();
  for (const OrganView& organ : view.organs) {
    programs.organ_depth.set("model", model_matrix(organ.pose));
    organs.at(organ.id).draw();
  }
  programs.instrument_depth.use();
  for (const InstrumentView& instrument : view.instruments) {
    programs.instrument_depth.set("model", model_matrix(instrument));
    instruments.at(instrument.id).draw();
  }
  glDepthMask(GL_FALSE);
  glDisable(GL_DEPTH_TEST);
}

void Renderer::Data::find_occlusion() {
  targets->depth.bind(kDepthUnit);
  programs.half_depth.set("depth_map", kDepthUnit);
  full_screen(programs.half_depth, targets->distance_target, kNowhere);
  targets->distance.bind(kDistanceUnit);
  programs.occlusion.set("distance_map", kDistanceUnit);
  full_screen(programs.occlusion, targets->open_rough_target, kOpen);
  targets->open_rough.bind(kOpenUnit);
  programs.occlusion_blur.set("distance_map", kDistanceUnit);
  programs.occlusion_blur.set("open_map", kOpenUnit);
  full_screen(programs.occlusion_blur, targets->open_target, kOpen);
  targets->open.bind(kOpenUnit);
}

void Renderer::Data::shade_organs(const FrameView& view) {
  targets->scene.bind();
  glClearBufferfv(GL_COLOR, 0, kBackground);
  glEnable(GL_DEPTH_TEST);
  glDepthFunc(GL_EQUAL);
  for (const OrganView& organ : view.organs) {
    const OrganBuffers& buffers = organs.at(organ.id);
    const bool burnt = organ.burn != nullptr && buffers.burn() != nullptr;
    Program& program = burnt ? programs.burnt_organ : programs.organ;
    const TissueLook& look = organ.look;
    const float id = static_cast<float>(organ.id % 1024);
    program.use();
    program.set("model", model_matrix(organ.pose));
    program.set("rotation",
                Eigen::Matrix3f(organ.pose.orientation.toRotationMatrix().cast<float>()));
    program.set("open_map", kOpenUnit);
    program.set("colour", Eigen::Vector3f(look.colour.cast<float>()));
    program.set("mottle_colour", Eigen::Vector3f(look.mottle_colour.cast<float>()));
    program.set("vessel_colour", Eigen::Vector3f(look.vessel_colour.cast<float>()));
    program.set("seed_offset",
                Eigen::Vector3f(std::fmod(0.317f * id, 1.0f), std::fmod(0.571f * id, 1.0f),
                                std::fmod(0.739f * id, 1.0f)));
    program.set("mottle_scale", static_cast<float>(look.mottle_scale));
    program.set("mottle_amount", static_cast<float>(look.mottle_amount));
    program.set("vessel_scale", static_cast<float>(look.vessel_scale));
    program.set("vessel_amount", static_cast<float>(look.vessel_amount));
    program.set("bump_height", static_cast<float>(look.bump_height));
    program.set("bump_scale", static_cast<float>(look.bump_scale));
    program.set("wetness", static_cast<float>(look.wetness));
    program.set("translucency", static_cast<float>(look.translucency));
    if (burnt) buffers.burn()->bind(program, kBrickMapUnit, kAtlasUnit);
    buffers.draw();
  }
}

void Renderer::Data::shade_instruments(const FrameView& view) {
  programs.instrument.use();
  programs.instrument.set("open_map", kOpenUnit);
  for (const InstrumentView& instrument : view.instruments) {
    programs.instrument.set("model", model_matrix(instrument));
    instruments.at(instrument.id).draw();
  }
  glDisable(GL_DEPTH_TEST);
}

bool Renderer::Data::march_smoke(const FrameView& view) {
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
  targets->smoke_rough_target.bind();
  glClearBufferfv(GL_COLOR, 0, kNoSmoke);
  glEnable(GL_BLEND);
  glBlendFuncSeparate(GL_ONE, GL_SRC_ALPHA, GL_ZERO, GL_SRC_ALPHA);
  Program& program = programs.smoke;
  program.set("density_map", kDensityUnit);
  program.set("distance_map", kDistanceUnit);
  program.set("view_to_world",
              Eigen::Matrix3f(view_matrix(view.camera).block<3, 3>(0, 0).transpose()));
  for (const std::size_t i : order) {
    const SmokeView& volume = view.smoke[i];
    smoke[i].density().bind(kDensityUnit);
    program.set("domain_low", Eigen::Vector3f(volume.domain.min().cast<float>()));
    program.set("domain_size", Eigen::Vector3f(volume.domain.sizes().cast<float>()));
    program.set("filled_low", Eigen::Vector3f(smoke[i].filled().min().cast<float>()));
    program.set("filled_high", Eigen::Vector3f(smoke[i].filled().max().cast<float>()));
    program.set("mass_extinction", static_cast<float>(volume.mass_extinction));
    program.set("albedo", static_cast<float>(volume.albedo));
    program.set("asymmetry", static_cast<float>(volume.asymmetry));
    full_screen(program, targets->smoke_rough_target, nullptr);
  }
  glDisable(GL_BLEND);
  targets->smoke_rough.bind(kSmokeUnit);
  programs.smoke_blur.set("smoke_map", kSmokeUnit);
  programs.smoke_blur.set("distance_map", kDistanceUnit);
  full_screen(programs.smoke_blur, targets->smoke_target, kNoSmoke);
  targets->smoke.bind(kSmokeUnit);
  return true;
}

void Renderer::Data::spill_light() {
  targets->radiance.bind(kRadianceUnit);
  programs.bright.set("radiance_map", kRadianceUnit);
  full_screen(programs.bright, targets->spill_a_target, kBlack);
  programs.blur.set("source_map", kSpillUnit);
  targets->spill_a.bind(kSpillUnit);
  programs.blur.set("axis", Eigen::Vector2f(1.0f, 0.0f));
  full_screen(programs.blur, targets->spill_b_target, kBlack);
  targets->spill_b.bind(kSpillUnit);
  programs.blur.set("axis", Eigen::Vector2f(0.0f, 1.0f));
  full_screen(programs.blur, targets->spill_a_target, kBlack);
  targets->spill_a.bind(kSpillUnit);
}

void Renderer::Data::develop(bool with_smoke) {
  Program& program = with_smoke ? programs.develop_smoke : programs.develop;
  program.set("radiance_map", kRadianceUnit);
  program.set("depth_map", kDepthUnit);
  program.set("spill_map", kSpillUnit);
  program.set("smoke_map", kSmokeUnit);
  program.set("distance_map", kDistanceUnit);
  full_screen(program, targets->developed_target, kBlack);
  targets->developed.bind(kRadianceUnit);
  programs.smooth.set("developed_map", kRadianceUnit);
  full_screen(programs.smooth, targets->shown_target, kBlack);
}

void Renderer::Data::read_back(Picture& picture) {
  const std::size_t pixels = static_cast<std::size_t>(options.width) * options.height;
  rgba.resize(4 * pixels);
  targets->shown_target.bind();
  glPixelStorei(GL_PACK_ALIGNMENT, 1);
  glReadPixels(0, 0, options.width, options.height, GL_RGBA, GL_UNSIGNED_BYTE, rgba.data());
  picture.width = options.width;
  picture.height = options.height;
  picture.rgb.resize(3 * pixels);
  for (std::size_t i = 0; i < pixels; ++i) {
    for (std::size_t c = 0; c < 3; ++c) picture.rgb[3 * i + c] = rgba[4 * i + c];
  }
}

Renderer::Renderer(std::unique_ptr<Data> data) : data_(std::move(data)) {}

Renderer::~Renderer() = default;

Result<std::unique_ptr<Renderer>> Renderer::create(const RenderOptions& options) {
  if (options.width < 16 || options.height < 16 || options.width > 8192 || options.height > 8192) {
    return failure("picture size " + std::to_string(options.width) + " x " +
                   std::to_string(options.height) + ": expected 16 to 8192 pixels each way");
  }
  Result<std::unique_ptr<EglContext>> context = EglContext::create();
  if (!context) return std::unexpected(context.error());
  auto data = std::make_unique<Data>();
  data->context = *std::move(context);
  data->options = options;
  Result<Programs> programs = load_programs();
  if (!programs) return std::unexpected(programs.error());
  data->programs = *std::move(programs);
  data->targets.emplace(options.width, options.height);
  if (!data->targets->complete()) {
    return failure(data->context->device() + " can't draw into the renderer's textures");
  }
  data->frame_block.emplace();
  data->no_attributes.emplace();
  data->timer.emplace();
  glClipControl(GL_LOWER_LEFT, GL_ZERO_TO_ONE);
  return std::unique_ptr<Renderer>(new Renderer(std::move(data)));
}

Result<void> Renderer::draw(const FrameView& view, Picture& picture) {
  Data& data = *data_;
  data.context->make_current();
  data.timer->start();
  if (Result<void> done = data.update(view); !done) return done;
  data.upload_frame(view);
  data.timer->mark("upload");
  data.lay_depth(view);
  data.timer->mark("depth");
  data.find_occlusion();
  data.timer->mark("occlusion");
  data.shade_organs(view);
  data.timer->mark("organs");
  data.shade_instruments(view);
  data.timer->mark("instruments");
  const bool with_smoke = data.march_smoke(view);
  data.timer->mark("smoke");
  data.spill_light();
  data.timer->mark("spill");
  data.develop(with_smoke);
  data.timer->mark("develop");
  data.read_back(picture);
  data.pass_times = data.timer->finish();
  if (const GLenum error = glGetError(); error != GL_NO_ERROR) {
    return failure("OpenGL error " + std::to_string(error) + " while drawing on " + device());
  }
  return {};
}

std::string Renderer::device() const {
  return data_->context->device();
}

const std::vector<PassTime>& Renderer::pass_times() const {
  return data_->pass_times;
}

}  // namespace viscera
