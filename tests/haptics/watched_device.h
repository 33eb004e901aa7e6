// Keeps an eye on what a device is given, from whatever thread.
#pragma once

#include <atomic>
#include <functional>

#include "haptics/device.h"

namespace viscera::test {

/// Passes a device through, with limits of its own; `in_read` may break a reading, or block.
class WatchedDevice : public HapticDevice {
 public:
  using InRead = std::function<void(DeviceState&, std::uint64_t tick)>;
  explicit WatchedDevice(HapticDevice& inner, InRead in_read = {})
      : limits_(inner.limits()), inner_(inner), in_read_(std::move(in_read)) {}

  const std::string& name() const override { return inner_.name(); }
  const DeviceLimits& limits() const override { return limits_; }
  DeviceState read(std::uint64_t tick) noexcept override {
    DeviceState state = inner_.read(tick);
    if (in_read_) in_read_(state, tick);
    return state;
  }
  void write(const Vec3& force) noexcept override {
    if (writers_.fetch_add(1) != 0) ++together;
    ++writes;
    if (!force.allFinite()) ++not_finite;
    const double size = force.norm(), before = last;
    if (size > before && size - before > greatest_rise) greatest_rise = size - before;
    if (size > greatest) greatest = size;
    if (size > 0.0 && size < before) ++falls;
    last = size;
    inner_.write(force);
    writers_.fetch_sub(1);
  }

  DeviceLimits limits_;
  std::atomic<std::uint64_t> writes{0}, not_finite{0}, together{0};
  std::atomic<std::uint64_t> falls{0};  ///< writes of less than before, but of some force
  std::atomic<double> last{0.0}, greatest{0.0}, greatest_rise{0.0};  ///< [N]

 private:
  HapticDevice& inner_;
  InRead in_read_;
  std::atomic<int> writers_{0};
};

}  // namespace viscera::test
