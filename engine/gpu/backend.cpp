#include "engine/gpu/backend.h"

#include <array>
#include <utility>

#include "kernels/base/stopwatch.h"

namespace viscera {
namespace {

constexpr std::array<std::pair<Backend, std::string_view>, 3> kNames = {
    {{Backend::kAuto, "auto"}, {Backend::kCpu, "cpu"}, {Backend::kGpu, "gpu"}}};

}  // namespace

std::string name_of(Backend backend) {
  for (const auto& [value, name] : kNames)
    if (value == backend) return std::string(name);
  return {};
}

std::optional<Backend> backend_of(std::string_view text) {
  for (const auto& [value, name] : kNames)
    if (name == text) return value;
  return std::nullopt;
}

Result<BackendDecision> decide_backend(Backend asked, Driver driver, const std::string& device) {
  switch (asked) {
    case Backend::kCpu:
      return BackendDecision{Backend::kCpu, "asked for", ""};
    case Backend::kGpu:
      if (driver == Driver::kNone)
        return failure(
            "--backend gpu: found no OpenGL driver, expected one with OpenGL 4.5 (--backend cpu "
            "needs none): " +
            device);
      if (driver == Driver::kHardware) return BackendDecision{Backend::kGpu, "asked for", ""};
      return BackendDecision{Backend::kGpu, "asked for",
                             "--backend gpu: " + device +
                                 " is a software driver: it shows that results are right, not how "
                                 "fast they would be"};
    case Backend::kAuto:
      break;
  }
  switch (driver) {
    case Driver::kHardware:
      return BackendDecision{Backend::kGpu, "auto: " + device + " is graphics hardware", ""};
    case Driver::kSoftware:
      return BackendDecision{Backend::kCpu, "auto: " + device + " is a software driver", ""};
    case Driver::kNone:
      break;
  }
  return BackendDecision{Backend::kCpu, "auto: no graphics hardware", ""};
}

Result<ComputeDevice> open_compute_device(Backend asked, bool pictures) {
  const Stopwatch watch;
  ComputeDevice device;
  Driver driver = Driver::kNone;
  std::string name;
  if (asked == Backend::kGpu || (asked == Backend::kAuto && (pictures || egl_lists_hardware()))) {
    auto made = EglContext::create();
    if (made) {
      device.context = *std::move(made);
      name = device.context->device();
      driver = device.context->software() ? Driver::kSoftware : Driver::kHardware;
    } else {
      name = made.error().text();
    }
  }
  auto decision = decide_backend(asked, driver, name);
  if (!decision) return std::unexpected(decision.error());
  device.decision = *std::move(decision);
  if (device.decision.backend == Backend::kCpu && !pictures) device.context.reset();
  device.start_s = watch.seconds();
  return device;
}

}  // namespace viscera
