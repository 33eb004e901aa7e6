// What a scene's contacts are worth: its forces and shapes against the same scene on half the node
// spacing.
#pragma once

#include <map>
#include <string>

#include "engine/scene/scene.h"
#include "engine/scene/tissues.h"
#include "kernels/base/result.h"

namespace viscera {

struct SceneAccuracy {
  /// Root of the summed squares over the scene's time, of the difference over that of the finer
  /// scene; of the instrument or organ where it is greatest.
  double force_error = 0.0;
  double profile_error = 0.0;  ///< of the drawn vertices' displacement
};

/// Runs the scene twice without pictures and without the cache. Fails as the scene does, or where
/// this machine's memory doesn't hold the finer organs.
Result<SceneAccuracy> compare_with_half_spacing(const SceneDescription& scene,
                                                const std::map<std::string, Tissue>& tissues);

}  // namespace viscera
