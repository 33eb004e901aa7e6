// Pictures full of smoke, timed.
#pragma once

#include <memory>
#include <string>

#include "engine/gpu/egl_context.h"
#include "engine/render/renderer.h"
#include "engine/verification/smoke_case.h"

namespace viscera {

struct SmokePictureTimes {
  double median_ms = 0.0, p99_ms = 0.0;
};

/// Draws a case's smoke from a lens in it that looks down on the sheet, so that both fill the view.
class SmokePictures {
 public:
  static constexpr int kWidth = 1280, kHeight = 720;

  /// 1280 x 720 at review quality. Fails where there is no GL driver. `context`: see RenderOptions.
  static Result<SmokePictures> create(std::shared_ptr<EglContext> context);

  /// Of so many pictures after a first one; fails on Ctrl-C.
  Result<SmokePictureTimes> time(const SmokeCase& smoke, const SmokeGrid& grid, int pictures);
  std::string device() const { return renderer_->device(); }
  const Picture& last() const { return picture_; }

 private:
  explicit SmokePictures(std::unique_ptr<Renderer> renderer) : renderer_(std::move(renderer)) {}

  std::unique_ptr<Renderer> renderer_;
  Picture picture_;
  std::uint32_t sheets_ = 0;  // drawn so far: their ids
};

}  // namespace viscera
