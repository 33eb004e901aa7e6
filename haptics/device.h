// What the servo loop knows of a force feedback device. Vendors' SDKs, models, recordings and
// sockets stand behind it (haptics/README.md says how to add one).
#pragma once

#include <cstdint>
#include <string>

#include "haptics/servo_event.h"
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
};

/// One device, read and written once a tick by one thread. read() and write() neither wait nor
/// allocate nor throw; what is slow (sockets, USB) happens on a thread of the device's own.
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
};

}  // namespace viscera
