// Many organs, no two alike, that touch each other: what `viscera profile --different` steps.
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

struct DifferentOrgans {
  std::vector<int> organs = {14, 32, 64, 128, 256};
  double seconds = 1.0;         ///< simulated in each case
  double most_prepare = 180.0;  ///< no more organs are prepared once this has passed [s]
  std::filesystem::path json, plots;
};

/// So many organs of a tissue, on a square grid so narrow that neighbours lie about a millimetre
/// apart: balls, half balls and blocks whose sizes differ, held from below, some 100 nodes each.
/// Every third breathes into its neighbour. `tissue` is a name among the scene's.
SceneDescription different_organs(int organs, const std::string& tissue);

struct DifferentCase {
  int organs = 0;
  double prepare_s = 0.0;  ///< of all of them, so far
  double place_s = 0.0;    ///< pairs, patches and what they overlap at rest, of this case
  std::size_t pairs = 0, meeting = 0, islands = 0, rows = 0;  ///< the last three: at most
  std::size_t awake = 0;       ///< organs that were deformed or touched in a frame: at most
  std::vector<double> frames;  ///< [s]
};

/// Steps them by the thread pool as any scene and prints a line each. What wasn't prepared in time
/// is told and left out.
Result<void> profile_different(const std::string& tissue,
                               const std::map<std::string, Tissue>& tissues,
                               const DifferentOrgans& options, std::ostream& out);

}  // namespace viscera
