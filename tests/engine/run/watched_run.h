// A world with all its observers, stepped as a run does, for tests that stop and go on.
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <vector>

#include "engine/run/observer.h"
#include "engine/run/watch.h"
#include "engine/scene/scene.h"
#include "tests/support/small_world.h"

namespace viscera::test {

/// A hook that comes down on a ball's pole with current, in a volume of smoke, before a camera:
/// something for every observer.
SceneDescription watched_scene();

class WatchedRun {
 public:
  /// Places the world, and steps it to `frame` with nobody looking.
  WatchedRun(const SceneDescription& scene, const std::filesystem::path& folder, bool pictures,
             std::uint64_t frame);
  ~WatchedRun();

  Result<void> begin();
  /// Goes on from what save() gave.
  Result<void> go_on(const Checkpoint& checkpoint);
  Result<void> step_to(std::uint64_t frame);
  Result<Checkpoint> save();
  /// Ends all files; the report as its observers describe it, without times.
  Result<RunReport> end();

  World& world() { return *world_; }

 private:
  const SceneDescription& scene_;
  std::filesystem::path folder_;
  std::unique_ptr<World> world_;
  Trace trace_;
  StageClock clock_;
  std::unique_ptr<Studio> studio_;
  std::optional<FrameViews::Makers> makers_;
  Watch watch_;
};

}  // namespace viscera::test
