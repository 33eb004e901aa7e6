#include <gtest/gtest.h>

#include <limits>
#include <memory>

#include "haptics/devices/recording.h"
#include "haptics/devices/simulated_device.h"
#include "haptics/servo_loop.h"
#include "kernels/base/archive.h"
#include "kernels/base/random.h"
#include "tests/haptics/servo_world.h"
#include "tests/haptics/watched_device.h"

namespace viscera::test {
namespace {

constexpr std::uint64_t kEnd = 2600;

SimulatedDeviceSettings touching_now_and_then() {
  SimulatedDeviceSettings settings;
  settings.path = path_along_z(
      {{0.2, 0.02}, {0.6, -0.012}, {1.0, 0.0}, {1.3, -0.03}, {1.7, 0.02}, {2.4, -0.01}});
  return settings;
}

// A wall that answers with no number for a while: the loop lets go and comes back.
class FailingWall final : public TactileModel {
 public:
  TactileForce respond(const ToolMotion& motion, double dt) noexcept override {
    TactileForce felt = wall_.respond(motion, dt);
    if (motion.tick >= 1250 && motion.tick < 1253)
      felt.force.x() = std::numeric_limits<double>::quiet_NaN();
    return felt;
  }

 private:
  VirtualWall wall_ = wall_at_zero(900.0, 1.0);
};

// A device, a recorder, a servo on the logical clock.
struct Rig {
  std::unique_ptr<HapticDevice> device = std::make_unique<SimulatedDevice>(touching_now_and_then());
  RecordingDevice recorder{*device, 1e-3, 2500};
  FailingWall wall;
  ServoTick servo{recorder, wall, {}};
  LockstepServo clock{servo};

  Rig() = default;
  explicit Rig(std::unique_ptr<HapticDevice> other) : device(std::move(other)) {}

  struct State {
    std::vector<std::byte> device;
    ServoTick::State servo;
    LockstepServo::State clock;
    static constexpr auto fields() {
      return std::tuple(field("device", &State::device), field("servo", &State::servo),
                        field("clock", &State::clock));
    }
  };
  State state() const { return {recorder.state_bytes(), servo.state(), clock.state()}; }
  void restore(const State& state) {
    ASSERT_TRUE(recorder.fits_bytes(state.device));
    ASSERT_TRUE(ServoTick::fits(state.servo));
    recorder.restore_bytes(state.device);
    servo.restore(state.servo);
    clock.restore(state.clock);
  }
  // The bits of every tick up to `end`, of its events and of the recording.
  std::string live(std::uint64_t end) {
    Hasher hash;
    while (clock.next() < end) {
      clock.advance_to(clock.next() + 1);
      write(hash, servo.output());
      hash.value(servo.energy_given()).value(servo.greatest_force());
      if (clock.next() % 400 == 0)
        for (const ServoEvent& event : take_events(servo.events())) write(hash, event);
    }
    write(hash, recorder.recording().samples);
    hash.value(recorder.dropped());
    return hash.hex();
  }
};

void goes_on_bit_for_bit(const std::function<std::unique_ptr<HapticDevice>()>& device,
                         std::uint64_t stream) {
  const Random random(12, stream);
  Rig lived(device());
  lived.live(700);
  lived.servo.release();
  lived.live(900);
  // Engaging; while the fault fades; away; coming back; when the recorder is full.
  std::vector<std::uint64_t> moments{0, 1, 150, 1260, 1310, 1500, 2550};
  for (std::uint64_t i = 0; i < 5; ++i)
    moments.push_back(static_cast<std::uint64_t>(static_cast<double>(kEnd) * random.uniform(i)));
  for (const std::uint64_t moment : moments) {
    Rig first(device());
    first.live(moment);
    const std::vector<std::byte> bytes = saved(first.state());
    const std::string whole = first.live(kEnd);
    EXPECT_GT(first.servo.greatest_force(), 0.5);
    Rig fresh(device());
    for (Rig* other : {&fresh, &lived, &first}) {
      ByteReader reader(bytes);
      Rig::State state;
      read(reader, state);
      ASSERT_TRUE(!reader.failed() && reader.at_end());
      other->restore(state);
      EXPECT_EQ(first_difference(other->state(), state), "") << moment;
      EXPECT_EQ(other->live(kEnd), whole) << moment;
    }
  }
}

TEST(ServoState, AHandThatIsModelledAndItsLoopGoOnBitForBitFromAnyTick) {
  goes_on_bit_for_bit([] { return std::make_unique<SimulatedDevice>(touching_now_and_then()); }, 1);
}

TEST(ServoState, AReplayAndItsLoopGoOnBitForBitFromAnyTick) {
  Rig recorded;
  recorded.live(2000);
  const HapticRecording& recording = recorded.recorder.recording();
  goes_on_bit_for_bit([&] { return std::make_unique<RecordedDevice>(recording); }, 2);
}

TEST(ServoState, WhatItHeldIsPartOfTheDynamicsThatAreRestored) {
  Rig rig;
  rig.live(1255);  // the fault fades
  EXPECT_EQ(rig.state().servo.guard.phase, DeviceGuard::Phase::kFading);
  EXPECT_FALSE(rig.state().servo.events.waiting.empty());
  EXPECT_GT(rig.state().servo.fading.norm(), 0.0);
}

TEST(ServoState, ADeviceThatIsMovedFromOutsideSaysThatItCannotBeSaved) {
  SimulatedDevice simulated{touching_now_and_then()};
  WatchedDevice outside(simulated);
  RecordingDevice recorder(outside, 1e-3, 10);
  EXPECT_EQ(simulated.why_not_saved(), "");
  for (const HapticDevice* device :
       {static_cast<const HapticDevice*>(&outside), static_cast<const HapticDevice*>(&recorder)}) {
    EXPECT_NE(device->why_not_saved().find("can't be put back"), std::string::npos);
    EXPECT_FALSE(device->fits_bytes(device->state_bytes()));
  }
}

TEST(ServoState, BytesOfAnotherDeviceAreRefused) {
  SimulatedDevice simulated{touching_now_and_then()};
  RecordingDevice recorder(simulated, 1e-3, 20);
  for (std::uint64_t tick = 0; tick < 30; ++tick) {
    recorder.read(tick);
    recorder.write(Vec3(0.1, 0.0, 0.0));
  }
  const auto bytes = recorder.state_bytes();
  EXPECT_TRUE(recorder.fits_bytes(bytes));
  for (std::size_t n = 0; n < bytes.size(); n += 13)
    EXPECT_FALSE(recorder.fits_bytes(std::span(bytes).first(n))) << n;
  EXPECT_FALSE(simulated.fits_bytes(bytes));
  RecordingDevice smaller(simulated, 1e-3, 19);
  EXPECT_FALSE(smaller.fits_bytes(bytes));
  HapticRecording recording = recorder.recording();
  RecordedDevice replay(recording);
  replay.read(25);
  recording.samples.resize(5);
  EXPECT_TRUE(replay.fits_bytes(replay.state_bytes()));
  EXPECT_FALSE(RecordedDevice(recording).fits_bytes(replay.state_bytes()));
  SimulatedDevice::State broken = simulated.state();
  broken.position.x() = std::numeric_limits<double>::infinity();
  EXPECT_FALSE(simulated.fits(broken));
}

TEST(ServoState, StatesWithoutMeaningDoNotFit) {
  Rig rig;
  rig.live(300);
  const ServoTick::State good = rig.servo.state();
  ASSERT_TRUE(ServoTick::fits(good));
  ServoTick::State state = good;
  state.guard.phase = static_cast<DeviceGuard::Phase>(7);
  EXPECT_FALSE(ServoTick::fits(state));
  state = good;
  state.events.waiting.resize(ServoEventRing::kSlots + 1);
  EXPECT_FALSE(ServoTick::fits(state));
  state = good;
  state.events.waiting.push_back({1, static_cast<ServoEventKind>(200), 0.0});
  EXPECT_FALSE(ServoTick::fits(state));
}

TEST(ServoState, ARingKeepsWhatNobodyHasReadAndHowMuchItDropped) {
  ServoEventRing ring;
  for (std::uint64_t i = 0; i < 400; ++i) {
    ring.push({i, ServoEventKind::kFlood, 0.5});
    ServoEvent event;
    if (i < 100) ring.pop(event);
  }
  ServoEventRing other;
  other.push({7, ServoEventKind::kEngaged, 0.0});
  other.restore(ring.state());
  EXPECT_EQ(other.dropped(), ring.dropped());
  EXPECT_EQ(other.dropped(), 44u);
  const auto waiting = take_events(ring);
  ASSERT_EQ(waiting.size(), 256u);
  EXPECT_EQ(waiting.front().tick, 100u);
  EXPECT_EQ(first_difference(take_events(other), waiting), "");
}

}  // namespace
}  // namespace viscera::test
