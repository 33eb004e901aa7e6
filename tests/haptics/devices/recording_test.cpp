#include "haptics/devices/recording.h"

#include <gtest/gtest.h>

#include <limits>

#include "tests/haptics/allocations.h"
#include "tests/haptics/servo_world.h"
#include "tests/haptics/watched_device.h"

namespace viscera::test {
namespace {

SimulatedDeviceSettings dipping() {
  SimulatedDeviceSettings settings;
  settings.path = path_along_z({{0.2, 0.02}, {0.6, -0.01}, {1.0, 0.02}});
  return settings;
}

TEST(RecordedDevice, AReplayGivesTheSameForcesBitForBit) {
  SimulatedDevice simulated{dipping()};
  // A fault on the way: that comes back too.
  WatchedDevice broken(simulated, [](DeviceState& state, std::uint64_t tick) {
    if (tick >= 700 && tick < 720)
      state.pose.position.x() = std::numeric_limits<double>::quiet_NaN();
  });
  RecordingDevice recorder(broken, 1e-3, 2000);
  VirtualWall wall = wall_at_zero(600.0);
  ServoTick live(recorder, wall, {});
  const auto first = run_ticks(live, 0, 1500);

  RecordedDevice replayed(recorder.recording());
  EXPECT_TRUE(replayed.exact());
  ServoTick again(replayed, wall, {});
  const auto second = run_ticks(again, 0, 1500);
  double most = 0.0;
  for (std::size_t i = 0; i < first.size(); ++i) {
    ASSERT_EQ(first[i].force, second[i].force) << i;
    most = std::max(most, first[i].force.norm());
  }
  EXPECT_GT(most, 1.0);
}

TEST(RecordedDevice, AfterItsLastReadingTheDeviceIsGone) {
  SimulatedDevice simulated{dipping()};
  RecordingDevice recorder(simulated, 1e-3, 600);
  VirtualWall wall = wall_at_zero(600.0);
  ServoTick live(recorder, wall, {});
  run_ticks(live, 0, 600);
  RecordedDevice replayed(recorder.recording());
  ServoTick again(replayed, wall, {});
  const auto outputs = run_ticks(again, 0, 900);
  EXPECT_GT(outputs[599].force.norm(), 0.5);
  EXPECT_EQ(outputs.back().force, Vec3::Zero());
  EXPECT_TRUE(has_event(take_events(again.events()), ServoEventKind::kDeviceLost));
}

TEST(RecordedDevice, ReadingsBetweenTheTicksAreInterpolated) {
  HapticRecording recording;
  recording.limits = phantom_premium_1_0a();
  for (int i = 0; i <= 10; ++i) {  // 60 a second, on a straight way at a steady speed
    HapticSample sample;
    sample.time = i / 60.0;
    sample.state.pose.position = Vec3(0.1 * sample.time, 0.0, 0.0);
    recording.samples.push_back(sample);
  }
  RecordedDevice device(recording);
  EXPECT_FALSE(device.exact());
  for (std::uint64_t tick = 0; tick <= 160; ++tick) {
    const DeviceState state = device.read(tick);
    EXPECT_NEAR(state.pose.position.x(), 1e-4 * static_cast<double>(tick), 1e-12);
    EXPECT_TRUE(state.connected);
  }
}

TEST(RecordedDevice, AnEmptyRecordingIsADeviceThatIsNotThere) {
  RecordedDevice device{HapticRecording{}};
  EXPECT_FALSE(device.read(0).connected);
}

TEST(RecordingDevice, ItTakesNoMemoryWhileItRecordsAndCountsWhatDoesNotFit) {
  SimulatedDevice simulated{dipping()};
  RecordingDevice recorder(simulated, 1e-3, 100);
  const std::uint64_t before = allocations();
  for (std::uint64_t tick = 0; tick < 150; ++tick) {
    recorder.read(tick);
    recorder.write(Vec3(0.0, 0.0, 1.0));
  }
  EXPECT_EQ(allocations(), before);
  EXPECT_EQ(recorder.recording().samples.size(), 100u);
  EXPECT_EQ(recorder.dropped(), 50u);
}

}  // namespace
}  // namespace viscera::test
