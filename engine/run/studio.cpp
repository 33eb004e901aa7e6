#include "engine/run/studio.h"

#include <fmt/format.h>

#include <utility>

#include "engine/gpu/egl_context.h"

namespace viscera {

Result<void> Studio::make_renderer() {
  RenderOptions render;
  render.width = options_.width;
  render.height = options_.height;
  render.quality = options_.quality;
  render.context = context_;
  auto renderer = Renderer::create(render);
  if (!renderer) return std::unexpected(renderer.error());
  renderer_ = *std::move(renderer);
  return {};
}

Result<std::unique_ptr<Studio>> Studio::open(const StudioOptions& options,
                                             std::shared_ptr<EglContext> context) {
  if (!context) {
    auto made = EglContext::create();
    if (!made) return std::unexpected(made.error());
    context = *std::move(made);
  }
  std::unique_ptr<Studio> studio(new Studio(options));
  studio->context_ = std::move(context);
  if (auto made = studio->make_renderer(); !made) return std::unexpected(made.error());
  return studio;
}

Result<void> Studio::reopen(double time) {
  leave_();
  const std::string lost = renderer_->device();
  renderer_.reset();  // before another context is there to take its objects' names for its own
  auto context = EglContext::create();
  if (!context)
    return failure(
        fmt::format("{}: its OpenGL context was lost at {:.2f} s, and pictures need "
                    "another: {}",
                    lost, time, context.error().text()));
  context_ = *std::move(context);
  if (auto made = make_renderer(); !made) return made;
  warnings_.push_back(fmt::format(
      "{}: its OpenGL context was lost at {:.2f} s; pictures went on with another one on {}", lost,
      time, renderer_->device()));
  return {};
}

Result<void> Studio::draw(const std::function<const FrameView&()>& view, double time) {
  const auto drawn = [&] {
    std::shared_ptr<PassImages> truth;
    if (options_.passes) truth = std::make_shared<PassImages>();
    passes_ = truth;
    return renderer_->draw(view(), picture_, truth.get());
  };
  Result<void> done = drawn();
  if (done || !context_->lost()) return done;
  if (auto reopened = reopen(time); !reopened) return reopened;
  return drawn();
}

}  // namespace viscera
