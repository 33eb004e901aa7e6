#include "haptics/hive_builder.h"

namespace viscera {

HiveBuilder::HiveBuilder(HiveBuilding building) : building_(building) {
  if (building_ == HiveBuilding::kOnAThread) thread_ = std::thread([this] { work(); });
}

HiveBuilder::~HiveBuilder() {
  if (!thread_.joinable()) return;
  state_.store(kStop, std::memory_order_release);
  state_.notify_one();
  thread_.join();
}

void HiveBuilder::work() {
  for (;;) {
    state_.wait(kIdle, std::memory_order_acquire);
    state_.wait(kDone, std::memory_order_acquire);
    std::uint32_t wanted = kWanted;
    const std::uint32_t now = state_.load(std::memory_order_acquire);
    if (now == kStop) return;
    if (now != kWanted) continue;
    verdict_ = hive_->build(centre_);
    // Stopping while it was built stays stopping.
    state_.compare_exchange_strong(wanted, kDone, std::memory_order_acq_rel);
  }
}

void HiveBuilder::request(Hive& hive, const SurfaceSpot& centre) noexcept {
  hive_ = &hive;
  centre_ = centre;
  if (building_ == HiveBuilding::kInLockstep) {
    verdict_ = hive_->build(centre_);
    ticks_left_ = kLockstepTicks;
    return;
  }
  state_.store(kWanted, std::memory_order_release);
  state_.notify_one();
}

bool HiveBuilder::ready() noexcept {
  if (!hive_) return false;
  if (building_ == HiveBuilding::kInLockstep) return --ticks_left_ <= 0;
  return state_.load(std::memory_order_acquire) == kDone;
}

HiveBuilder::State HiveBuilder::state() const {
  return {busy(), verdict_, ticks_left_, built_};
}

void HiveBuilder::restore(const State& state, Hive* hive) noexcept {
  hive_ = state.busy ? hive : nullptr;
  verdict_ = state.verdict;
  ticks_left_ = state.ticks_left;
  built_ = state.built;
}

bool HiveBuilder::fits(const State& state) const noexcept {
  return building_ == HiveBuilding::kInLockstep && state.verdict >= HiveVerdict::kSound &&
         state.verdict <= HiveVerdict::kNotBuilt;
}

HiveVerdict HiveBuilder::take() noexcept {
  hive_ = nullptr;
  ++built_;
  if (building_ == HiveBuilding::kOnAThread) state_.store(kIdle, std::memory_order_release);
  return verdict_;
}

}  // namespace viscera
