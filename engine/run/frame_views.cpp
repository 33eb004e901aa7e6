#include "engine/run/frame_views.h"

#include "engine/features/smoke/smoke.h"

namespace viscera {

std::span<const ShownSmoke> FrameViews::smoke() {
  if (!splatted_ && world_.has<SmokeBody>()) {
    const StageClock::Scope scope(makers_.clock, RunStage::kSplatSmoke);
    splat_smoke(world_, makers_.shown.smoke);
  }
  splatted_ = true;
  return makers_.shown.smoke;
}

std::optional<CameraView> FrameViews::camera() const {
  if (!makers_.endoscope) return {};
  return makers_.endoscope->at(world_.time());
}

Result<FrameViews::Shot> FrameViews::shot() {
  if (!makers_.studio || !makers_.endoscope) return failure("this run draws no pictures");
  if (!shooting_) {
    smoke();
    const StageClock::Scope scope(makers_.clock, RunStage::kDraw);
    const auto view = [&]() -> const FrameView& {
      view_ = make_view(world_, makers_.shown, makers_.scene, *makers_.endoscope, drawn_);
      return *view_;
    };
    shooting_ = makers_.studio->draw(view, world_.time());
  }
  if (!*shooting_) return std::unexpected(shooting_->error());
  return Shot{makers_.studio->picture(), *view_, makers_.studio->passes()};
}

}  // namespace viscera
