// What a device read and what force it was given, tick by tick: written while a loop runs, read
// back in its place. The files are engine/io/haptic_recording.h.
#pragma once

#include <string>
#include <vector>

#include "haptics/device.h"

namespace viscera {

struct HapticSample {
  double time = 0.0;  ///< [s]
  DeviceState state;
  Vec3 force = Vec3::Zero();  ///< [N] on the hand, from then on
};

struct HapticRecording {
  std::string device;                 ///< its name
  DeviceLimits limits;                ///< a replay has the same, or the forces would differ
  double dt = 1e-3;                   ///< [s] of a tick
  std::vector<HapticSample> samples;  ///< times rise
};

/// Stands between a loop and its device and keeps what passes. All memory is taken at the start;
/// what comes after it is full is counted.
class RecordingDevice : public HapticDevice {
 public:
  RecordingDevice(HapticDevice& inner, double dt, std::size_t most_samples);

  const std::string& name() const override { return inner_.name(); }
  const DeviceLimits& limits() const override { return inner_.limits(); }
  DeviceState read(std::uint64_t tick) noexcept override;
  void write(const Vec3& force) noexcept override;
  bool next_event(ServoEvent& event) override { return inner_.next_event(event); }

  /// After the loop has ended.
  const HapticRecording& recording() const { return recording_; }
  std::uint64_t dropped() const { return dropped_; }

 private:
  HapticDevice& inner_;
  HapticRecording recording_;
  std::size_t most_;
  Pose finite_;  // the last pose that was one
  bool kept_ = false;
  std::uint64_t dropped_ = 0;
};

/// Plays a recording. Where its times are ticks, as RecordingDevice's are, each reading comes back
/// as it was, so that the same loop gives the same forces bit for bit; else readings are
/// interpolated. After the last one the device is gone.
class RecordedDevice : public HapticDevice {
 public:
  explicit RecordedDevice(HapticRecording recording);

  const std::string& name() const override { return name_; }
  const DeviceLimits& limits() const override { return recording_.limits; }
  DeviceState read(std::uint64_t tick) noexcept override;
  void write(const Vec3&) noexcept override {}

  const HapticRecording& recording() const { return recording_; }
  /// On the ticks: they come back bit for bit.
  bool exact() const { return exact_; }

 private:
  std::string name_;
  HapticRecording recording_;
  bool exact_ = true;
  std::size_t next_ = 0;  // the first sample after the last read
};

}  // namespace viscera
