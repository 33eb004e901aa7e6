#include "haptics/device_pen.h"

namespace viscera {

bool DevicePen::write(const Vec3& force) noexcept {
  std::uint32_t expected = kTicks;
  if (pen_.compare_exchange_strong(expected, kWriting, std::memory_order_acq_rel)) {
    held_ = force;
    device_.write(force);
    pen_.store(kTicks, std::memory_order_release);
    return true;
  }
  expected = kLetGo;
  if (pen_.compare_exchange_strong(expected, kWriting, std::memory_order_acq_rel)) {
    held_ = Vec3::Zero();
    device_.write(held_);
    pen_.store(kTicks, std::memory_order_release);
  }
  return false;
}

bool DevicePen::take() noexcept {
  std::uint32_t expected = kTicks;
  return pen_.compare_exchange_strong(expected, kWatchdog, std::memory_order_acq_rel);
}

void DevicePen::let_go() noexcept {
  held_ = Vec3::Zero();
  device_.write(held_);
  pen_.store(kLetGo, std::memory_order_release);
}

}  // namespace viscera
