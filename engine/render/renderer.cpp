#include "engine/render/renderer.h"

#include <epoxy/gl.h>

#include <optional>

#include "engine/gpu/egl_context.h"
#include "engine/render/canvas.h"
#include "engine/render/geometry_passes.h"
#include "engine/render/lens_pass.h"
#include "engine/render/passes.h"
#include "engine/render/scene_buffers.h"
#include "engine/render/shading_passes.h"

namespace viscera {
namespace {

struct Passes {
  DepthPass depth;
  OcclusionPass occlusion;
  OrganPass organs;
  InstrumentPass instruments;
  StrandPass strands;
  SmokePass smoke;
  LabelPass labels;
  LensPass lens;
};

Result<Passes> create_passes(const QualitySettings& settings) {
  Error error;
  const auto take = [&error](auto& pass, auto created) {
    if (created) {
      pass = *std::move(created);
    } else {
      error.messages.insert(error.messages.end(), created.error().messages.begin(),
                            created.error().messages.end());
    }
  };
  Passes passes;
  take(passes.depth, DepthPass::create());
  take(passes.occlusion, OcclusionPass::create(settings));
  take(passes.organs, OrganPass::create(settings));
  take(passes.instruments, InstrumentPass::create());
  take(passes.strands, StrandPass::create());
  take(passes.smoke, SmokePass::create(settings));
  take(passes.labels, LabelPass::create());
  take(passes.lens, LensPass::create(settings));
  if (!error.messages.empty()) return std::unexpected(error);
  return passes;
}

void read_back(const Canvas& canvas, std::vector<std::uint8_t>& rgba, Picture& picture) {
  const std::size_t pixels =
      static_cast<std::size_t>(canvas.width) * static_cast<std::size_t>(canvas.height);
  rgba.resize(4 * pixels);
  canvas.shown.target.bind();
  glPixelStorei(GL_PACK_ALIGNMENT, 1);
  glReadPixels(0, 0, canvas.width, canvas.height, GL_RGBA, GL_UNSIGNED_BYTE, rgba.data());
  picture.width = canvas.width;
  picture.height = canvas.height;
  picture.rgb.resize(3 * pixels);
  for (std::size_t i = 0; i < pixels; ++i) {
    for (std::size_t c = 0; c < 3; ++c) picture.rgb[3 * i + c] = rgba[4 * i + c];
  }
}

}  // namespace

struct Renderer::Data {
  // First made, last destroyed: what follows deletes its GL objects in it.
  std::shared_ptr<EglContext> context;
  Canvas canvas;
  Passes passes;
  SceneBuffers buffers;
  std::optional<PassLayers> layers;  // made with the first picture that wants them
  PassTimer timer;
  std::vector<PassTime> pass_times;
  std::vector<std::uint8_t> rgba;

  ~Data() { context->make_current(); }
};

Renderer::Renderer(std::unique_ptr<Data> data) : data_(std::move(data)) {}

Renderer::~Renderer() = default;

Result<std::unique_ptr<Renderer>> Renderer::create(const RenderOptions& options) {
  if (options.width < 16 || options.height < 16 || options.width > 8192 || options.height > 8192) {
    return failure("picture size " + std::to_string(options.width) + " x " +
                   std::to_string(options.height) + ": expected 16 to 8192 pixels each way");
  }
  std::shared_ptr<EglContext> context = options.context;
  if (context == nullptr) {
    auto made = EglContext::create();
    if (!made) return std::unexpected(made.error());
    context = *std::move(made);
  }
  context->make_current();
  Result<Passes> passes = create_passes(settings_of(options.quality));
  if (!passes) return std::unexpected(passes.error());
  auto data = std::make_unique<Data>(std::move(context),
                                     Canvas(options.width, options.height, options.quality),
                                     *std::move(passes));
  if (!data->canvas.complete()) {
    return failure(data->context->device() + " can't draw into the renderer's textures");
  }
  glClipControl(GL_LOWER_LEFT, GL_ZERO_TO_ONE);
  return std::unique_ptr<Renderer>(new Renderer(std::move(data)));
}

Result<void> Renderer::draw(const FrameView& view, Picture& picture, PassImages* images) {
  Data& data = *data_;
  Passes& passes = data.passes;
  PassTimer& timer = data.timer;
  data.context->make_current();
  if (images != nullptr && !data.layers) {
    data.layers.emplace(data.canvas);
    if (!data.layers->complete())
      return failure(device() + " can't draw into the textures of a picture's passes");
  }
  const PassLayers* layers = images != nullptr ? &*data.layers : nullptr;
  timer.start();
  if (Result<void> done = data.buffers.update(view, layers != nullptr); !done) return done;
  data.canvas.begin(view);
  timer.mark("upload");
  passes.depth.draw(view, data.buffers, data.canvas);
  timer.mark("depth");
  passes.occlusion.draw(data.canvas);
  timer.mark("occlusion");
  if (Result<void> done = passes.organs.draw(view, data.buffers, data.canvas); !done) return done;
  timer.mark("organs");
  passes.instruments.draw(view, data.buffers, data.canvas);
  timer.mark("instruments");
  passes.strands.draw(view, data.buffers, data.canvas);
  timer.mark("strands");
  if (layers != nullptr) {
    passes.labels.draw(view, data.buffers, data.canvas, *layers);
    PassLayers::read_clean(data.canvas, *images);
  }
  if (Result<void> done = passes.smoke.draw(view, data.buffers, data.canvas, layers); !done)
    return done;
  timer.mark("smoke");
  if (layers != nullptr) layers->read_back(data.canvas, *images);
  passes.lens.meter(data.canvas);
  timer.mark("meter");
  passes.lens.develop(data.canvas);
  timer.mark("develop");
  read_back(data.canvas, data.rgba, picture);
  data.pass_times = timer.finish();
  if (data.context->lost()) return failure(device() + " lost its context while drawing");
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
