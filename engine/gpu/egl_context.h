// An off-screen OpenGL 4.5 core context through EGL, with no window system.
#pragma once

#include <memory>
#include <string>

#include "kernels/base/result.h"

namespace viscera {

/// Takes devices from eglQueryDevicesEXT, hardware first, then software, then surfaceless. Current
/// on the creating thread.
class EglContext {
 public:
  /// Fails with every device that was tried and why it was refused.
  static Result<std::unique_ptr<EglContext>> create();
  ~EglContext();
  EglContext(const EglContext&) = delete;
  EglContext& operator=(const EglContext&) = delete;

  /// Makes this context the calling thread's again, after another one was used there.
  void make_current() const;

  /// True once the driver has reset the device (a hang, a driver that was replaced, an eGPU that
  /// was pulled out): what the context holds is gone, its commands do nothing, and only another
  /// context can go on. Asks the driver, where this context is current and the driver tells; what
  /// it has said once stays.
  bool lost() const;
  /// As if the driver had: none resets because a test asks.
  void declare_lost() { lost_ = true; }

  const std::string& device() const { return device_; }  ///< GL_RENDERER
  bool software() const { return software_; }

 private:
  EglContext() = default;
  void* display_ = nullptr;
  void* context_ = nullptr;
  std::string device_;
  bool software_ = false;
  mutable bool lost_ = false;
};

/// Whether EGL lists a device that it doesn't call software; makes no context.
bool egl_lists_hardware();

/// How many contexts this process has asked EGL for: proves that a run without pictures asks for
/// none.
int egl_contexts_created();

}  // namespace viscera
