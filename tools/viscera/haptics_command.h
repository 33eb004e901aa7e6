// `viscera haptics`: a scene felt in real time, and how punctual and how fast that was.
#pragma once

#include <filesystem>
#include <iosfwd>
#include <map>
#include <optional>
#include <string>

#include "engine/scene/scene.h"
#include "engine/scene/tissues.h"
#include "kernels/base/result.h"

namespace viscera {

struct HapticsOptions {
  double seconds = 60.0;
  std::string device;               ///< in place of the scene's: "simulated", "recorded", "network"
  std::filesystem::path recording;  ///< for "recorded"
  int port = 0;                     ///< for "network"; 0: the scene's
  bool render = true;               ///< pictures beside, if the scene has a camera
  std::filesystem::path json;       ///< empty: none
  std::filesystem::path record;     ///< what the devices did and felt; empty: none
  std::filesystem::path plots;      ///< empty: none
};

/// Runs the scene against the wall clock until the time is over or Ctrl-C, and reports. Fails,
/// before anything starts, on a scene without a haptic tool or options that can't be.
Result<void> run_haptics(SceneDescription scene, const std::map<std::string, Tissue>& tissues,
                         const HapticsOptions& options, std::ostream& out);

}  // namespace viscera
