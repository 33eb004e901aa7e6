// `viscera profile`: what a scene's frames cost with more and more organs.
#pragma once

#include <filesystem>
#include <iosfwd>
#include <map>
#include <string>
#include <vector>

#include "engine/scene/scene.h"
#include "engine/scene/tissues.h"
#include "kernels/base/result.h"

namespace viscera {

struct ProfileOptions {
  std::vector<int> organs = {1, 2, 4, 8, 16, 32};
  int touched = 1;              ///< of them, at a time
  double seconds = 0.0;         ///< simulated in each case
  bool render = false;          ///< measure pictures too
  std::filesystem::path json;   ///< empty: none is written
  std::filesystem::path plots;  ///< folder; empty: nothing is drawn
  std::filesystem::path trace;  ///< timeline of the case with the most organs; empty: none
};

/// Prepares the scene's organs once, places so many of them, each for itself, and steps them with
/// the scene's instruments on `touched` of them and on none. Prints medians, memory, the cost of an
/// idle and of a touched organ and the slope, with the figures to reach.
Result<void> profile_scene(const SceneDescription& scene,
                           const std::map<std::string, Tissue>& tissues,
                           const ProfileOptions& options, std::ostream& out);

}  // namespace viscera
