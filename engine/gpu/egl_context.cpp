#include "engine/gpu/egl_context.h"

#include <epoxy/egl.h>
#include <epoxy/gl.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cstdio>
#include <vector>

namespace viscera {

namespace {

std::atomic<int> contexts_created = 0;

struct Candidate {
  EGLDisplay display = EGL_NO_DISPLAY;
  std::string name;
};

std::string egl_error() {
  char text[32];
  std::snprintf(text, sizeof text, "EGL error 0x%04x", static_cast<unsigned>(eglGetError()));
  return text;
}

struct Device {
  EGLDeviceEXT handle = EGL_NO_DEVICE_EXT;
  bool software = false;
};

std::vector<Device> list_devices() {
  if (!epoxy_has_egl_extension(EGL_NO_DISPLAY, "EGL_EXT_device_enumeration") &&
      !epoxy_has_egl_extension(EGL_NO_DISPLAY, "EGL_EXT_device_base")) {
    return {};
  }
  std::array<EGLDeviceEXT, 32> handles;
  EGLint count = 0;
  if (eglQueryDevicesEXT(handles.size(), handles.data(), &count) != EGL_TRUE) count = 0;
  std::vector<Device> devices;
  for (EGLint i = 0; i < count; ++i) {
    const auto handle = handles[static_cast<std::size_t>(i)];
    const char* extensions = eglQueryDeviceStringEXT(handle, EGL_EXTENSIONS);
    devices.push_back(
        {handle, extensions && std::string(extensions).find("EGL_MESA_device_software") !=
                                   std::string::npos});
  }
  return devices;
}

/// Displays worth trying: hardware devices, software devices, then Mesa's surfaceless platform.
std::vector<Candidate> find_displays() {
  std::vector<Candidate> hardware, software;
  const std::vector<Device> devices = list_devices();
  for (std::size_t i = 0; i < devices.size(); ++i) {
    Candidate candidate;
    candidate.display =
        eglGetPlatformDisplayEXT(EGL_PLATFORM_DEVICE_EXT, devices[i].handle, nullptr);
    candidate.name = "EGL device " + std::to_string(i) + (devices[i].software ? " (software)" : "");
    (devices[i].software ? software : hardware).push_back(candidate);
  }
  std::vector<Candidate> all = std::move(hardware);
  all.insert(all.end(), software.begin(), software.end());
  if (epoxy_has_egl_extension(EGL_NO_DISPLAY, "EGL_MESA_platform_surfaceless")) {
    all.push_back({eglGetPlatformDisplayEXT(EGL_PLATFORM_SURFACELESS_MESA, nullptr, nullptr),
                   "Mesa's surfaceless platform"});
  }
  return all;
}

/// A current 4.5 core context on this display, or why not.
Result<EGLContext> make_context(EGLDisplay display) {
  if (display == EGL_NO_DISPLAY) return failure("no display");
  EGLint major = 0, minor = 0;
  if (!eglInitialize(display, &major, &minor)) return failure("not initialised, " + egl_error());
  if (!eglBindAPI(EGL_OPENGL_API)) return failure("no desktop OpenGL, " + egl_error());
  const EGLint config_attributes[] = {EGL_SURFACE_TYPE, EGL_PBUFFER_BIT, EGL_RENDERABLE_TYPE,
                                      EGL_OPENGL_BIT, EGL_NONE};
  EGLConfig config = nullptr;
  EGLint configs = 0;
  if (!eglChooseConfig(display, config_attributes, &config, 1, &configs) || configs < 1) {
    config = EGL_NO_CONFIG_KHR;
  }
  // A driver that can tell that it has reset the device is asked to; others make a context without.
  EGLContext context = EGL_NO_CONTEXT;
  for (const bool telling : {true, false}) {
    const EGLint attributes[] = {
        EGL_CONTEXT_MAJOR_VERSION,
        4,
        EGL_CONTEXT_MINOR_VERSION,
        5,
        EGL_CONTEXT_OPENGL_PROFILE_MASK,
        EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT,
        telling ? EGL_CONTEXT_OPENGL_RESET_NOTIFICATION_STRATEGY : EGL_NONE,
        EGL_LOSE_CONTEXT_ON_RESET,
        EGL_NONE};
    context = eglCreateContext(display, config, EGL_NO_CONTEXT, attributes);
    if (context != EGL_NO_CONTEXT) break;
  }
  if (context == EGL_NO_CONTEXT) return failure("no OpenGL 4.5 core context, " + egl_error());
  if (!eglMakeCurrent(display, EGL_NO_SURFACE, EGL_NO_SURFACE, context)) {
    const std::string why = egl_error();
    eglDestroyContext(display, context);
    return failure("context can't be current without a surface, " + why);
  }
  return context;
}

}  // namespace

bool egl_lists_hardware() {
  const std::vector<Device> devices = list_devices();
  return std::any_of(devices.begin(), devices.end(),
                     [](const Device& device) { return !device.software; });
}

int egl_contexts_created() {
  return contexts_created;
}

Result<std::unique_ptr<EglContext>> EglContext::create() {
  ++contexts_created;
  Error error("no off-screen OpenGL: expected an EGL device with OpenGL 4.5 core; tried:");
  for (const Candidate& candidate : find_displays()) {
    const Result<EGLContext> made = make_context(candidate.display);
    if (!made) {
      error.messages.push_back("  " + candidate.name + ": " + made.error().text());
      continue;
    }
    std::unique_ptr<EglContext> context(new EglContext);
    context->display_ = candidate.display;
    context->context_ = *made;
    const GLubyte* renderer = glGetString(GL_RENDERER);
    context->device_ = renderer ? reinterpret_cast<const char*>(renderer) : "unknown";
    for (const char* name : {"llvmpipe", "softpipe", "SWR", "swrast"}) {
      if (context->device_.find(name) != std::string::npos) context->software_ = true;
    }
    return context;
  }
  if (error.messages.size() == 1) error.messages.push_back("  nothing: EGL offers no display");
  return std::unexpected(error);
}

EglContext::~EglContext() {
  // The display is shared by every context of the process on this device: it's left initialised.
  if (eglGetCurrentContext() == context_) {
    eglMakeCurrent(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
  }
  eglDestroyContext(display_, context_);
}

bool EglContext::lost() const {
  if (!lost_ && eglGetCurrentContext() == context_)
    lost_ = glGetGraphicsResetStatus() != GL_NO_ERROR;
  return lost_;
}

void EglContext::make_current() const {
  if (eglGetCurrentContext() == context_) return;
  // The bound client API is per thread, and another thread may not have bound desktop OpenGL.
  eglBindAPI(EGL_OPENGL_API);
  eglMakeCurrent(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, context_);
}

}  // namespace viscera
