#include "engine/gpu/gpu_limits.h"

#include <epoxy/gl.h>

#include <algorithm>

namespace viscera {
namespace {

std::string megabytes(std::size_t bytes) {
  return std::to_string((bytes + 999'999) / 1'000'000) + " MB";
}

}  // namespace

GpuLimits GpuLimits::of_device() {
  GpuLimits limits;
  GLint64 block = 0;
  glGetInteger64v(GL_MAX_SHADER_STORAGE_BLOCK_SIZE, &block);
  limits.block_bytes = static_cast<std::size_t>(std::max<GLint64>(block, 0));
  GLint across = 0, down = 0;
  glGetIntegeri_v(GL_MAX_COMPUTE_WORK_GROUP_COUNT, 0, &across);
  glGetIntegeri_v(GL_MAX_COMPUTE_WORK_GROUP_COUNT, 1, &down);
  limits.groups_per_axis = static_cast<std::size_t>(std::clamp(std::min(across, down), 1, 65535));
  return limits;
}

Result<void> check_bindings(const std::string& who, int most) {
  GLint buffers = 0, bindings = 0;
  glGetIntegerv(GL_MAX_COMPUTE_SHADER_STORAGE_BLOCKS, &buffers);
  glGetIntegerv(GL_MAX_SHADER_STORAGE_BUFFER_BINDINGS, &bindings);
  if (std::min(buffers, bindings) >= most) return {};
  return failure(who + ": a kernel may bind " + std::to_string(std::min(buffers, bindings)) +
                 " storage buffers on this device, expected " + std::to_string(most));
}

void GpuWatch::begin() {
  make_current();
  // A lost context reports errors for ever.
  for (int i = 0; i < 16 && glGetError() != GL_NO_ERROR; ++i) {
  }
  trouble_.clear();
}

bool GpuWatch::fail(const std::string& why) {
  if (trouble_.empty()) trouble_ = who_ + ": " + why;
  return false;
}

bool GpuWatch::is_well() {
  if (context_ && context_->lost()) return fail("its context was lost");
  const GLenum error = glGetError();
  if (error == GL_NO_ERROR) return trouble_.empty();
  return fail(error == GL_OUT_OF_MEMORY  ? "out of memory"
              : error == GL_CONTEXT_LOST ? "its context was lost"
                                         : "GL error " + std::to_string(error));
}

bool GpuWatch::fits(std::size_t bytes, const GpuLimits& limits, const char* what) {
  if (bytes <= limits.block_bytes) return true;
  return fail(std::string(what) + " would make a storage buffer of " + megabytes(bytes) +
              ", this device binds at most " + megabytes(limits.block_bytes));
}

}  // namespace viscera
