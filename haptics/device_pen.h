// Who may write to a device: its tick, or the watchdog that takes its place.
#pragma once

#include <atomic>
#include <cstdint>

#include "haptics/device.h"

namespace viscera {

/// One thread at a time is in HapticDevice::write, and neither waits for the other: who doesn't get
/// the pen goes on without. The watchdog keeps it until the force is zero; then it lies there for
/// the next tick, which learns from it that the device was let go of.
class DevicePen {
 public:
  explicit DevicePen(HapticDevice& device) : device_(device) {}

  /// Tick: writes [N]. False: the watchdog has had the pen since the last time. Then this force
  /// wasn't written, and zero was or will be.
  bool write(const Vec3& force) noexcept;

  /// Watchdog: takes the pen. False: a tick is in the middle of a write, or the device has been let
  /// go of already.
  bool take() noexcept;
  /// Watchdog, with the pen: the force that the device had when it was taken [N].
  const Vec3& held() const noexcept { return held_; }
  /// Watchdog, with the pen: writes this share of it.
  void fade_to(double share) noexcept { device_.write(share * held_); }
  /// Watchdog, with the pen: writes zero and leaves the pen to the next tick.
  void let_go() noexcept;

  /// Ticks begin anew; no other thread is at work.
  void give_back() noexcept { pen_.store(kTicks, std::memory_order_release); }

 private:
  enum : std::uint32_t {
    kTicks,     ///< the next tick takes it
    kWriting,   ///< a tick is in write()
    kWatchdog,  ///< the watchdog has it
    kLetGo      ///< zero was written; the next tick takes it
  };

  HapticDevice& device_;
  Vec3 held_ = Vec3::Zero();  // whoever has the pen
  std::atomic<std::uint32_t> pen_{kTicks};
};

}  // namespace viscera
