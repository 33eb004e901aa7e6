// A device on the other end of a TCP connection that speaks OpenIGTLink: poses in, forces out.
#pragma once

#include <atomic>
#include <memory>
#include <string>
#include <thread>

#include "haptics/device.h"
#include "haptics/triple_buffer.h"
#include "kernels/base/result.h"

namespace viscera {

struct NetworkDeviceSettings {
  /// Only programs of this machine, unless told otherwise: whoever connects moves the tool.
  std::string address = "127.0.0.1";
  int port = 18944;                        ///< OpenIGTLink's own; 0 takes a free one
  std::string force_name = "HapticForce";  ///< of the SENSOR messages
  DeviceLimits limits;                     ///< of what stands behind the client; see below

  NetworkDeviceSettings();  ///< limits: half a metre each way, forces of a PHANToM
};

/// Listens; one client at a time sends TRANSFORM (rigid, millimetres) and gets a SENSOR with three
/// values in newtons for each force that the loop writes, at most 1,000 a second. A thread of its
/// own does all that waits; a read or a write of the loop is an exchange of a triple buffer. A
/// client that breaks the protocol, floods, or stops in the middle is cut off, and the next one may
/// come; next_event() tells.
class NetworkDevice : public HapticDevice {
 public:
  /// Fails where the address can't be listened on.
  static Result<std::unique_ptr<NetworkDevice>> open(const NetworkDeviceSettings& settings);
  ~NetworkDevice() override;

  const std::string& name() const override { return name_; }
  const DeviceLimits& limits() const override { return settings_.limits; }
  DeviceState read(std::uint64_t tick) noexcept override;
  void write(const Vec3& force) noexcept override;
  bool next_event(ServoEvent& event) override { return events_.pop(event); }

  int port() const { return port_; }  ///< that it listens on

 private:
  class Connection;
  NetworkDevice(const NetworkDeviceSettings& settings, int listener, int port);
  void serve();
  void publish(const DeviceState& state);

  NetworkDeviceSettings settings_;
  std::string name_;
  int listener_, port_;
  TripleBuffer<DeviceState> states_;  // network thread to loop
  TripleBuffer<Vec3> forces_;         // loop to network thread
  std::uint64_t samples_ = 0;         // of all clients
  ServoEventRing events_;
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

}  // namespace viscera
