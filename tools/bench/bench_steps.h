// `viscera bench steps`: a scene's time against its error, by the length of a step.
#pragma once

#include <filesystem>
#include <iosfwd>
#include <map>
#include <string>

#include "engine/scene/scene.h"
#include "engine/scene/tissues.h"
#include "kernels/base/result.h"

namespace viscera {

struct StepsBenchOptions {
  std::filesystem::path json, plots;  ///< empty: none is written
};

/// Runs the scene with 30, 60 and 120 steps a second, and with 240, which the others are compared
/// with; without pictures, and tools where their paths have them. Fails as the scene does, where no
/// instrument of it touches anything, or on Ctrl-C.
Result<void> bench_steps(const SceneDescription& scene,
                         const std::map<std::string, Tissue>& tissues,
                         const StepsBenchOptions& options, std::ostream& out);

}  // namespace viscera
