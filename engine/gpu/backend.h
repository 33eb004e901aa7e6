// Where a run computes what has twins on the CPU and on the GPU: asked for by --backend, decided
// once.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "engine/gpu/egl_context.h"
#include "kernels/base/result.h"

namespace viscera {

enum class Backend { kAuto, kCpu, kGpu };

std::string name_of(Backend backend);
/// "auto", "cpu" or "gpu".
std::optional<Backend> backend_of(std::string_view name);

/// What OpenGL runs on here.
enum class Driver { kNone, kSoftware, kHardware };

struct BackendDecision {
  Backend backend = Backend::kCpu;  ///< never kAuto
  std::string reason;               ///< in a few words
  std::string warning;              ///< empty: none
};

/// The rule. kAuto takes the GPU where the driver is hardware: a software driver computes on the
/// same CPU, more slowly. kGpu takes any driver, with a warning where it is software, and fails
/// without one. `device`: the driver's name; for kNone why there is none.
Result<BackendDecision> decide_backend(Backend asked, Driver driver, const std::string& device);

/// What a run computes on.
struct ComputeDevice {
  BackendDecision decision;
  /// Also for its pictures. Null: none was needed, or there is none.
  std::shared_ptr<EglContext> context;
  double start_s = 0.0;  ///< for finding out, and for the context
};

/// Looks at this machine as far as the rule needs it. Makes a context for kGpu, and for kAuto where
/// pictures need one anyway or EGL lists graphics hardware; none for kCpu.
Result<ComputeDevice> open_compute_device(Backend asked, bool pictures);

}  // namespace viscera
