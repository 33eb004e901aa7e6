// `viscera bench scene`: what the main job costs on this machine, beside its targets and its error.
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

struct BenchOptions {
  std::filesystem::path json;                ///< empty: none is written
  bool quick = false;                        ///< three simulated seconds, and no preparation afresh
  std::vector<std::string> scene_arguments;  ///< name the scene to another call of the program
};

/// Prepares, simulates and films the scene in a temporary folder; prints one row a figure with its
/// target, met or not, and beside the speeds what they are worth: how the scene's contact forces
/// change on nodes 1.5 times as far apart, and the error on a ball against a cloud four times
/// finer.
Result<void> bench_scene(const SceneDescription& scene,
                         const std::map<std::string, Tissue>& tissues, const BenchOptions& options,
                         std::ostream& out);

}  // namespace viscera
