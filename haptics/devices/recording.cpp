#include "haptics/devices/recording.h"

#include <cmath>
#include <utility>

#include "haptics/devices/state_bytes.h"

namespace viscera {
namespace {

/// Times as decimal fractions are this close to the ticks that they mean.
constexpr double kSameTime = 1e-9;

}  // namespace

RecordingDevice::RecordingDevice(HapticDevice& inner, double dt, std::size_t most_samples)
    : inner_(inner), most_(most_samples) {
  recording_.device = inner.name();
  recording_.limits = inner.limits();
  recording_.dt = dt;
  recording_.samples.reserve(most_samples);
}

DeviceState RecordingDevice::read(std::uint64_t tick) noexcept {
  const DeviceState state = inner_.read(tick);
  last_.store(nullptr, std::memory_order_relaxed);
  if (recording_.samples.size() >= most_) {
    ++dropped_;
    return state;
  }
  HapticSample sample;
  sample.time = static_cast<double>(tick) * recording_.dt;
  sample.state = state;
  const Pose& pose = state.pose;
  if (pose.position.allFinite() && pose.orientation.coeffs().allFinite()) {
    finite_ = pose;
  } else {
    // A file holds numbers only; a loop does the same with a device that is gone.
    sample.state.pose = finite_;
    sample.state.connected = false;
  }
  recording_.samples.push_back(sample);
  last_.store(&recording_.samples.back(), std::memory_order_release);
  return state;
}

void RecordingDevice::write(const Vec3& force) noexcept {
  if (HapticSample* last = last_.load(std::memory_order_acquire)) last->force = force;
  inner_.write(force);
}

RecordingDevice::State RecordingDevice::state() const {
  return {inner_.state_bytes(), recording_.samples, finite_, last_.load() != nullptr, dropped_};
}

void RecordingDevice::restore(const State& state) {
  inner_.restore_bytes(state.inner);
  recording_.samples.assign(state.samples.begin(), state.samples.end());
  finite_ = state.finite;
  last_ = state.kept ? &recording_.samples.back() : nullptr;
  dropped_ = state.dropped;
}

bool RecordingDevice::fits(const State& state) const {
  return state.samples.size() <= most_ && (!state.kept || !state.samples.empty()) &&
         inner_.fits_bytes(state.inner);
}

std::vector<std::byte> RecordingDevice::state_bytes() const {
  return saved(*this);
}
bool RecordingDevice::fits_bytes(std::span<const std::byte> bytes) const {
  return state_in(bytes, *this).has_value();
}
void RecordingDevice::restore_bytes(std::span<const std::byte> bytes) {
  if (const auto state = state_in(bytes, *this)) restore(*state);
}

RecordedDevice::RecordedDevice(HapticRecording recording)
    : name_("recorded (" + recording.device + ")"), recording_(std::move(recording)) {
  for (const HapticSample& sample : recording_.samples) {
    const double ticks = sample.time / recording_.dt;
    exact_ = exact_ && std::abs(ticks - std::round(ticks)) * recording_.dt < kSameTime;
  }
}

DeviceState RecordedDevice::read(std::uint64_t tick) noexcept {
  const std::vector<HapticSample>& samples = recording_.samples;
  const double time = static_cast<double>(tick) * recording_.dt;
  while (state_.next < samples.size() && samples[state_.next].time <= time + kSameTime)
    ++state_.next;
  DeviceState gone;
  gone.connected = false;
  if (samples.empty()) return gone;
  if (state_.next == 0) return samples.front().state;
  const HapticSample& last = samples[state_.next - 1];
  if (state_.next == samples.size() && time > last.time + recording_.dt) {
    gone.pose = last.state.pose;
    gone.sample = last.state.sample;
    return gone;
  }
  DeviceState state = last.state;
  if (exact_) return state;

  state.sample = tick + 1;
  if (state_.next == samples.size()) return state;
  const HapticSample& to = samples[state_.next];
  const double share = (time - last.time) / (to.time - last.time);
  if (share > 0.0) {
    state.pose.position += share * (to.state.pose.position - state.pose.position);
    state.pose.orientation = state.pose.orientation.slerp(share, to.state.pose.orientation);
  }
  return state;
}

std::vector<std::byte> RecordedDevice::state_bytes() const {
  return saved(*this);
}
bool RecordedDevice::fits_bytes(std::span<const std::byte> bytes) const {
  return state_in(bytes, *this).has_value();
}
void RecordedDevice::restore_bytes(std::span<const std::byte> bytes) {
  if (const auto state = state_in(bytes, *this)) restore(*state);
}

}  // namespace viscera
