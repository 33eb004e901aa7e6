// A moment of a run as observers see it.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>

#include "engine/run/stage_clock.h"
#include "engine/run/studio.h"
#include "engine/run/view.h"

namespace viscera {

/// Of a film.
inline constexpr std::uint64_t kPicturesPerSecond = 30;
/// Every picture is the state after so many steps: rates are whole multiples (scene_keys.cpp).
constexpr std::uint64_t steps_a_picture(const StepRate& steps) {
  return steps.per_second / kPicturesPerSecond;
}

/// What costs something is made when somebody first asks for it, once, and counted for the stage
/// that it is. The world stays as it is.
class FrameViews {
 public:
  /// What lasts from moment to moment.
  struct Makers {
    const SceneDescription& scene;
    Studio* studio = nullptr;  ///< null: the run draws nothing
    StageClock& clock;
    std::optional<Endoscope> endoscope = {};  ///< the scene's, where it has a camera
    Shown shown = {};
  };

  /// `number`: of the picture whose time it is, from 0. `drawn`: how many were drawn before.
  FrameViews(const World& world, Makers& makers, std::uint64_t number, std::uint64_t drawn)
      : world_(world), makers_(makers), number_(number), drawn_(drawn) {}

  const World& world() const { return world_; }
  std::uint64_t number() const { return number_; }

  /// One a smoke volume.
  std::span<const ShownSmoke> smoke();
  /// None where the scene has no camera.
  std::optional<CameraView> camera() const;

  /// The picture, and all that it was drawn from: both until the next moment. Where the run draws
  /// none, fails; so does a device that can't go on.
  struct Shot {
    const Picture& picture;
    const FrameView& view;
    std::shared_ptr<const PassImages> passes;  ///< null: none are wanted
  };
  Result<Shot> shot();

 private:
  const World& world_;
  Makers& makers_;
  std::uint64_t number_, drawn_;
  bool splatted_ = false;
  std::optional<FrameView> view_;
  std::optional<Result<void>> shooting_;
};

}  // namespace viscera
