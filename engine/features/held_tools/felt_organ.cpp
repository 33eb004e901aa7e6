#include "engine/features/held_tools/felt_organ.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "engine/features/local/hive_settings.h"

namespace viscera {
namespace {

/// Of the cosine between a hive's force and the frame's: below, they stand on different walls.
constexpr double kAlike = 0.5;

}  // namespace

Result<std::unique_ptr<FeltBody>> felt_body(const InstrumentDescription& instrument,
                                            const OrganBody& organ, bool cut, HiveBuilding building,
                                            std::shared_ptr<const WalkableSurface>& surface) {
  const auto wrong = [&](const char* key, const Error& error) {
    return failure(fmt::format("{}: organ \"{}\": {}", key, organ.name, error.text()));
  };
  const auto settings = hive_settings(instrument, organ, building);
  if (!settings) return std::unexpected(settings.error());
  if (!surface) {
    auto walkable = WalkableSurface::make(organ.model->surface);
    if (!walkable) return wrong("haptic", walkable.error());
    surface = std::make_shared<const WalkableSurface>(std::move(*walkable));
  }
  auto tissue = HiveTissue::create(
      {surface.get(), &organ.model->compliance, &organ.model->touchable}, *settings);
  if (!tissue) return wrong("haptic/hive", tissue.error());
  return std::make_unique<FeltBody>(FeltBody{organ.model, surface, cut, std::move(*tissue)});
}

FeltOrgan::FeltOrgan(Entity organ, std::unique_ptr<FeltBody> body)
    : organ_(organ), newest_(body.get()), now_(std::move(body)) {}

FeltOrgan::~FeltOrgan() {
  delete coming_.load();
  delete gone_.load();
}

void FeltOrgan::take_over() noexcept {
  // The one before is the frame's to destroy, which may wait; until it has, there is no other.
  if (gone_.load(std::memory_order_acquire)) return;
  std::unique_ptr<FeltBody> next(coming_.exchange(nullptr, std::memory_order_acquire));
  if (!next) return;
  next->tissue->go_on_from(*now_->tissue);
  std::swap(now_, next);
  gone_.store(next.release(), std::memory_order_release);
  afresh_ = true;
}

/// Where no hive stands, where the frame meets tissue that a walk doesn't lead to, and where both
/// stand on different walls; then for a frame at least.
bool FeltOrgan::frame_answers(const TactileForce& by_hives, const TactileForce& found,
                              double dt) noexcept {
  const HiveTissue& tissue = *now_->tissue;
  const bool apart = by_hives.touching && by_hives.force.dot(found.force) <
                                              kAlike * by_hives.force.norm() * found.force.norm();
  if (!stands() || !tissue.covers() ||
      (now_->cut && found.touching && (!tissue.foot().whole() || apart))) {
    by_hives_for_ = 0.0;
    return true;
  }
  by_hives_for_ += dt;
  return by_frame_ && by_hives_for_ < kFrameEasing;
}

TactileForce FeltOrgan::respond(const ToolMotion& motion, double dt) noexcept {
  take_over();
  TactileForce felt = now_->tissue->respond(motion, dt);
  const TactileForce found = frame_.respond(motion.pose.position, dt);
  const bool by_frame = frame_answers(felt, found, dt);
  if (by_frame) felt = found;
  afresh_ |= std::exchange(by_frame_, by_frame) != by_frame;
  easing_left_ = std::max(0.0, easing_left_ - dt);
  if (std::exchange(afresh_, false)) {
    change_ = force_ - felt.force;
    easing_left_ = change_.isZero(0.0) ? 0.0 : kFrameEasing;
  }
  if (easing_left_ > 0.0) {
    felt.force += easing_left_ / kFrameEasing * change_;
    felt.touching = true;
    felt.energy = -1.0;  // nobody knows what two bodies at once would give back
  }
  force_ = felt.force;
  return felt;
}

void FeltOrgan::become(std::unique_ptr<FeltBody> next) {
  lost_.store(next == nullptr, std::memory_order_relaxed);
  next_ = std::move(next);
}

void FeltOrgan::hand_over(const SurfacePoint& nearest) {
  delete gone_.exchange(nullptr, std::memory_order_acquire);
  if (!next_) return;
  next_->tissue->stand_at(nearest);
  newest_ = next_.get();
  // One that wasn't taken in a whole frame isn't the organ's any more.
  delete coming_.exchange(next_.release(), std::memory_order_acq_rel);
}

FeltOrgan::State FeltOrgan::state() const {
  return {now_->tissue->state(), frame_.state(), force_,    change_,
          easing_left_,          afresh_,        by_frame_, by_hives_for_};
}

void FeltOrgan::restore(State state) {
  hand_over({});
  take_over();
  now_->tissue->restore(std::move(state.tissue));
  frame_.restore(std::move(state.frame));
  force_ = state.force;
  change_ = state.change;
  easing_left_ = state.easing_left;
  afresh_ = state.afresh;
  by_frame_ = state.by_frame;
  by_hives_for_ = state.by_hives_for;
}

bool FeltOrgan::fits(const State& state) const {
  return tissue().fits(state.tissue) && FrameFeel::fits(state.frame) && state.force.allFinite() &&
         state.change.allFinite() && state.easing_left >= 0.0 &&
         state.easing_left <= kFrameEasing && state.by_hives_for >= 0.0;
}

}  // namespace viscera
