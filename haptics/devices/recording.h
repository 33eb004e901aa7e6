// What a device read and what force it was given, tick by tick: written while a loop runs, read
// back in its place. The files are engine/features/held_tools/haptic_recording.h.
#pragma once

#include <atomic>
#include <string>
#include <vector>

#include "haptics/device.h"

namespace viscera {

struct HapticSample {
  double time = 0.0;  ///< [s]
  DeviceState state;
  Vec3 force = Vec3::Zero();  ///< [N] on the hand, from then on

  static constexpr auto fields() {
    return std::tuple(field("time", &HapticSample::time), field("state", &HapticSample::state),
                      field("force", &HapticSample::force));
  }
};
static_assert(fields_cover<HapticSample>());

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

  /// All that has been kept: a run that is gone on with elsewhere writes the whole recording.
  struct State {
    std::vector<std::byte> inner;  ///< of the device behind
    std::vector<HapticSample> samples;
    Pose finite;        ///< the last pose that was one
    bool kept = false;  ///< the last reading is among the samples
    std::uint64_t dropped = 0;
    static constexpr auto fields() {
      return std::tuple(field("inner", &State::inner), field("samples", &State::samples),
                        field("finite", &State::finite), field("kept", &State::kept),
                        field("dropped", &State::dropped));
    }
  };
  State state() const;
  void restore(const State& state);
  bool fits(const State& state) const;

  std::string why_not_saved() const override { return inner_.why_not_saved(); }
  std::vector<std::byte> state_bytes() const override;
  bool fits_bytes(std::span<const std::byte> bytes) const override;
  void restore_bytes(std::span<const std::byte> bytes) override;

 private:
  HapticDevice& inner_;
  HapticRecording recording_;
  std::size_t most_;
  Pose finite_;
  /// Of the last reading, which write() completes, from another thread too; null: it isn't kept.
  std::atomic<HapticSample*> last_{nullptr};
  std::uint64_t dropped_ = 0;
};
static_assert(fields_cover<RecordingDevice::State>() && StateOwner<RecordingDevice>);

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

  struct State {
    std::uint64_t next = 0;  ///< the first sample after the last read
    static constexpr auto fields() { return std::tuple(field("next", &State::next)); }
  };
  const State& state() const { return state_; }
  void restore(const State& state) { state_ = state; }
  bool fits(const State& state) const { return state.next <= recording_.samples.size(); }

  std::string why_not_saved() const override { return {}; }
  std::vector<std::byte> state_bytes() const override;
  bool fits_bytes(std::span<const std::byte> bytes) const override;
  void restore_bytes(std::span<const std::byte> bytes) override;

 private:
  std::string name_;
  HapticRecording recording_;
  bool exact_ = true;
  State state_;
};
static_assert(fields_cover<RecordedDevice::State>() && StateOwner<RecordedDevice>);

}  // namespace viscera
