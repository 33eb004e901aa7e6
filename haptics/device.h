// What the servo loop knows of a force feedback device. Vendors' SDKs, models, recordings and
// sockets stand behind it (haptics/README.md says how to add one).
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "haptics/servo_event.h"
#include "kernels/base/fields.h"
#include "kernels/base/types.h"

namespace viscera {

/// What a device can do, by its maker's figures; SI units, in the device's own frame.
struct DeviceLimits {
  Box work_space;                 ///< [m] where its handle can be
  double peak_force = 0.0;        ///< [N] for a short while
  double continuous_force = 0.0;  ///< [N] for any time
  double resolution = 0.0;        ///< [m] step of the positions
  double apparent_mass = 0.0;     ///< [kg] that the hand feels at the handle
  double friction = 0.0;          ///< [N] that the hand overcomes to move it (Coulomb)
  double stiffness = 0.0;         ///< [N/m] of the stiffest wall that it can show
  double stale_after = 0.02;      ///< [s] without a new reading: it has frozen
};

/// One reading. Whatever a broken device says may stand in it: DeviceGuard judges before use.
struct DeviceState {
  Pose pose;                  ///< of the handle, in the device's frame
  std::uint32_t buttons = 0;  ///< one bit each
  std::uint64_t sample = 0;   ///< counts the readings; the same number means the same reading
  bool connected = true;

  static constexpr auto fields() {
    return std::tuple(field("pose", &DeviceState::pose), field("buttons", &DeviceState::buttons),
                      field("sample", &DeviceState::sample),
                      field("connected", &DeviceState::connected));
  }
};
static_assert(fields_cover<DeviceState>());

/// One device, read and written once a tick by one thread. read() and write() neither wait nor
/// allocate nor throw; what is slow (sockets, USB) happens on a thread of the device's own.
///
/// On the wall clock write() may also come from a watchdog's thread, where no tick has ended for a
/// while (servo_loop.h). Then a read() may be under way on the tick's thread, or stuck there: the
/// device must allow one read() and one write() at once. Two are never in write() at once, and what
/// one wrote the next sees. A write() that doesn't return leaves the device its last force: nobody
/// else can take that back, so let the hardware have a watchdog of its own where it can.
class HapticDevice {
 public:
  virtual ~HapticDevice() = default;
  virtual const std::string& name() const = 0;
  virtual const DeviceLimits& limits() const = 0;
  /// The state at the start of this tick. Ticks rise, but a late loop skips some.
  virtual DeviceState read(std::uint64_t tick) noexcept = 0;
  /// The force on the hand [N], held until the next write.
  virtual void write(const Vec3& force) noexcept = 0;
  /// What happened on the device's own thread; asked by a thread that may wait.
  virtual bool next_event(ServoEvent&) { return false; }

  /// Why no run with this device can be saved or taken back; empty: it can. What moves a real
  /// handle is no part of the program.
  virtual std::string why_not_saved() const {
    return name() + ": a device that is moved from outside can't be put back where it was";
  }
  /// What its readings to come depend on, besides ticks and forces to come: between ticks, where it
  /// can be saved.
  virtual std::vector<std::byte> state_bytes() const { return {}; }
  /// The bytes are of such a device with the same settings.
  virtual bool fits_bytes(std::span<const std::byte>) const { return false; }
  /// Goes on from there; of bytes that fit.
  virtual void restore_bytes(std::span<const std::byte>) {}
};

}  // namespace viscera
