// Where a run's pictures are drawn, also after the driver has lost what it was drawn with.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "engine/render/renderer.h"
#include "kernels/base/result.h"

namespace viscera {

struct StudioOptions {
  int width = 1280, height = 720;
  Quality quality = Quality::kReview;
  bool passes = false;  ///< ground truth of every picture besides
};

class Studio {
 public:
  /// `context`: null, it makes its own.
  static Result<std::unique_ptr<Studio>> open(const StudioOptions& options,
                                              std::shared_ptr<EglContext> context);

  /// Called when the context is lost, before another one is made: whoever has put something there
  /// takes it back.
  void on_loss(std::function<void()> leave) { leave_ = std::move(leave); }

  /// Draws what `view` gives, which is asked again after a loss. `time` [s] is for messages.
  Result<void> draw(const std::function<const FrameView&()>& view, double time);

  const Picture& picture() const { return picture_; }  ///< the last one
  /// Its ground truth; null where none is wanted. Stays as it is while somebody holds it.
  const std::shared_ptr<const PassImages>& passes() const { return passes_; }
  const std::shared_ptr<EglContext>& context() const { return context_; }
  std::string device() const { return renderer_->device(); }
  /// What a person should know of losses.
  const std::vector<std::string>& warnings() const { return warnings_; }

 private:
  explicit Studio(const StudioOptions& options) : options_(options) {}
  Result<void> make_renderer();
  Result<void> reopen(double time);

  StudioOptions options_;
  std::shared_ptr<EglContext> context_;
  std::unique_ptr<Renderer> renderer_;
  std::function<void()> leave_ = [] {};
  Picture picture_;
  std::shared_ptr<const PassImages> passes_;
  std::vector<std::string> warnings_;
};

}  // namespace viscera
