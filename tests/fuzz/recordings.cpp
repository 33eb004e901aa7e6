#include "tests/fuzz/recordings.h"

#include <cmath>

#include "tests/fuzz/target.h"

namespace viscera::fuzz {

HapticRecording small_recording(std::size_t samples) {
  HapticRecording recording;
  recording.device = "simulated";
  recording.limits.work_space = Box(Vec3(-0.1, -0.1, -0.1), Vec3(0.1, 0.1, 0.1));
  recording.limits.peak_force = 8.5;
  recording.limits.continuous_force = 3.0;
  recording.limits.resolution = 1e-5;
  recording.limits.apparent_mass = 0.1;
  recording.limits.stiffness = 1000.0;
  recording.limits.stale_after = 0.05;
  for (std::size_t i = 0; i < samples; ++i) {
    HapticSample sample;
    sample.time = 1e-3 * static_cast<double>(i);
    sample.state.sample = i;
    sample.state.connected = i != 1;
    sample.force = Vec3(0.1, 1.0 / 3.0, 1e-7);
    recording.samples.push_back(sample);
  }
  return recording;
}

bool is_recording(const Result<HapticRecording>& recording) {
  if (!recording) return false;
  expect(recording->dt > 0.0 && std::isfinite(recording->dt), "ticks have a length");
  const HapticSample* before = nullptr;
  for (const HapticSample& sample : recording->samples) {
    expect(std::isfinite(sample.time) && (!before || sample.time > before->time), "time rises");
    expect(sample.state.pose.position.allFinite() && sample.force.allFinite(),
           "places and forces are finite");
    expect(std::abs(sample.state.pose.orientation.norm() - 1.0) < 2e-3, "a quaternion turns");
    before = &sample;
  }
  return true;
}

}  // namespace viscera::fuzz
