// Builds the next hive beside the one in use, so that no tick waits for it.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <thread>

#include "kernels/hive/hive.h"

namespace viscera {

/// Who builds.
enum class HiveBuilding {
  kOnAThread,   ///< of the builder's own, while ticks go on
  kInLockstep,  ///< the caller, at once; handed out a fixed number of ticks later, so that runs
                ///< repeat
};

/// One hive under construction at a time. request(), ready() and take() belong to the servo thread
/// and don't wait, lock or allocate.
class HiveBuilder {
 public:
  /// Ticks that building takes in lockstep.
  static constexpr int kLockstepTicks = 2;

  explicit HiveBuilder(HiveBuilding building);
  ~HiveBuilder();
  HiveBuilder(const HiveBuilder&) = delete;
  HiveBuilder& operator=(const HiveBuilder&) = delete;

  /// Starts to build `hive` about `centre`; it is the builder's until take(). Not while one is
  /// under way.
  void request(Hive& hive, const SurfaceSpot& centre) noexcept;
  bool busy() const noexcept { return hive_ != nullptr; }
  /// Once a tick: true when the hive is built.
  bool ready() noexcept;
  /// The hive that is ready, and how building it ended.
  HiveVerdict take() noexcept;

  std::uint64_t built() const noexcept { return built_; }

  /// Of the hive under construction all but itself: who owns the hives says which.
  struct State {
    bool busy = false;
    HiveVerdict verdict = HiveVerdict::kNotBuilt;
    int ticks_left = 0;
    std::uint64_t built = 0;
    static constexpr auto fields() {
      return std::tuple(field("busy", &State::busy), field("verdict", &State::verdict),
                        field("ticks_left", &State::ticks_left), field("built", &State::built));
    }
  };
  /// In lockstep alone: what a thread is at can't be told.
  State state() const;
  /// `hive`: which was under construction, restored; null: none.
  void restore(const State& state, Hive* hive) noexcept;
  bool fits(const State& state) const noexcept;

 private:
  enum : std::uint32_t { kIdle, kWanted, kDone, kStop };
  void work();

  const HiveBuilding building_;
  Hive* hive_ = nullptr;
  SurfaceSpot centre_;  // for the thread
  HiveVerdict verdict_ = HiveVerdict::kNotBuilt;
  int ticks_left_ = 0;
  std::uint64_t built_ = 0;
  std::atomic<std::uint32_t> state_{kIdle};
  std::thread thread_;
};
static_assert(fields_cover<HiveBuilder::State>());

}  // namespace viscera
