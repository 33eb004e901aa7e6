// Pictures of the scene: EGL off-screen, OpenGL 4.5 core, no X, no Vulkan.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "engine/gpu/pass_timer.h"
#include "engine/render/pass_images.h"
#include "engine/render/quality.h"
#include "engine/render/view.h"
#include "kernels/base/result.h"

namespace viscera {

/// 8-bit sRGB, rows from the top, 3 bytes a pixel.
struct Picture {
  int width = 0, height = 0;
  std::vector<std::uint8_t> rgb;
};

class EglContext;

struct RenderOptions {
  int width = 1280, height = 720;
  Quality quality = Quality::kReview;
  std::shared_ptr<EglContext> context = nullptr;  ///< null: the renderer makes its own
};

/// Owns everything of the pictures on the GPU. One thread only: the one that created it.
class Renderer {
 public:
  /// Creates the EGL context where none is given (hardware device first, then software) and
  /// compiles the shaders. Fails
  /// with what was tried when there is no driver; a shader error names file, line and source line.
  static Result<std::unique_ptr<Renderer>> create(const RenderOptions& options);
  ~Renderer();
  Renderer(const Renderer&) = delete;
  Renderer& operator=(const Renderer&) = delete;

  /// Draws one picture. Buffers of organs at rest are reused; only what moved is uploaded.
  /// `passes`: null, or what gets the picture's ground truth.
  Result<void> draw(const FrameView& view, Picture& picture, PassImages* passes = nullptr);

  /// "llvmpipe (LLVM 15.0.6, 256 bits)".
  std::string device() const;

  /// Time on the device of each pass of the last picture, in order.
  const std::vector<PassTime>& pass_times() const;

 private:
  struct Data;
  explicit Renderer(std::unique_ptr<Data> data);
  std::unique_ptr<Data> data_;
};

}  // namespace viscera
