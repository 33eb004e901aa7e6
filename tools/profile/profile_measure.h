// What frames of a scene cost with so many organs: the measurements behind `viscera profile`.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "engine/io/trace.h"
#include "tools/profile/profile_scene.h"

namespace viscera {

/// One occupancy, stepped for some seconds, several times over.
struct ProfileCase {
  explicit ProfileCase(const Occupancy& of) : occupancy(of) {}

  Occupancy occupancy;
  /// Stages in the order of a frame, "step" for the whole of it last, then those of a picture; of
  /// the frames in which a tool touches, where some do [s].
  std::vector<std::pair<std::string, std::vector<double>>> stages;
  std::vector<double> best_step;            ///< of each frame: the shortest of the rounds [s]
  std::vector<std::size_t> organs_touched;  ///< in each frame

  Quantiles stage(const std::string& name) const;
};

/// Everything that measurements share.
struct ProfileBench {
  const SceneDescription& scene;
  const std::map<std::string, Tissue>& tissues;
  OrganModels models;  ///< of the scene's organs
  Berths berths;
  std::uint64_t frames = 0;
};

/// How often each organ of the scene is touched as the scene stands, in frames, and how fast it
/// steps.
struct SceneItself {
  std::vector<std::size_t> touches;
  double wall_s = 0.0;
};
Result<SceneItself> step_scene_itself(const SceneDescription& scene,
                                      std::vector<InstrumentBody> instruments,
                                      const OrganModels& models,
                                      const std::map<std::string, Tissue>& tissues,
                                      std::uint64_t frames);

/// Another round of a case; `trace` gets the last one's timeline where it isn't null.
Result<void> step_case(const ProfileBench& bench, ProfileCase& one, std::unique_ptr<Trace>* trace);

/// Pictures of the case at moments spread over its time, all organs in them: time to draw, and of
/// each pass on the device. Gives the name of the device.
Result<std::string> draw_case(const ProfileBench& bench, ProfileCase& one);

/// What this process keeps resident beyond `before` while a world of this occupancy stands, touched
/// as it is to be [bytes].
Result<std::uint64_t> memory_of(const ProfileBench& bench, const Occupancy& occupancy,
                                std::uint64_t before);
/// Resident now, after what is free was given back [bytes].
std::uint64_t resident_bytes();

}  // namespace viscera
