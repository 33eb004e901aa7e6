// Devices that jump, freeze, send nonsense or are pulled out, while they press on something.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "tests/haptics/servo_world.h"
#include "tests/haptics/watched_device.h"

namespace viscera::test {
namespace {

constexpr std::uint64_t kFault = 1500, kMended = 1700, kEnd = 3000;

struct Case {
  const char* name;
  ServoEventKind kind;
  WatchedDevice::InRead how;
};

void PrintTo(const Case& c, std::ostream* out) {
  *out << c.name;
}

class MisbehavingDevice : public testing::TestWithParam<Case> {};

TEST_P(MisbehavingDevice, ForceGoesToZeroSmoothlyItIsReportedAndTheLoopLives) {
  SimulatedDeviceSettings settings;
  settings.path = path_along_z({{0.4, 0.02}, {0.9, -0.02}});
  SimulatedDevice inner(settings);
  WatchedDevice device(inner, GetParam().how);
  VirtualWall wall = wall_at_zero(300.0);
  ServoTick servo(device, wall, {});

  const auto before = run_ticks(servo, 0, kFault);
  ASSERT_GT(before.back().force.norm(), 1.0);
  ASSERT_EQ(take_events(servo.events()).size(), 1u);  // engaged

  const auto during = run_ticks(servo, kFault, kMended);
  const auto events = take_events(servo.events());
  ASSERT_EQ(events.size(), 1u) << "once, not at every tick";
  EXPECT_EQ(events[0].kind, GetParam().kind) << describe(events[0]);
  EXPECT_GE(events[0].tick, kFault);
  EXPECT_EQ(during.back().force, Vec3::Zero());
  const double fade = servo.settings().guard.fade_time;
  EXPECT_LT(greatest_step(during), 2.0 * before.back().force.norm() * 1e-3 / fade);

  // Mended, the hand feels the tissue again, and no bump on the way.
  const auto after = run_ticks(servo, kMended, kEnd);
  EXPECT_TRUE(has_event(take_events(servo.events()), ServoEventKind::kEngaged));
  EXPECT_NEAR(after.back().force.norm(), before.back().force.norm(), 0.2);
  EXPECT_LT(greatest_step(after), 0.1);
  for (const ServoOutput& out : after) {
    EXPECT_TRUE(out.force.allFinite());
    EXPECT_LT(out.force.norm(), 1.3 * before.back().force.norm());
  }
}

bool faulty(std::uint64_t tick) {
  return tick >= kFault && tick < kMended;
}

const Case kCases[] = {
    {"jumps", ServoEventKind::kDeviceJumped,
     [](DeviceState& state, std::uint64_t tick) {
       // There and back all the time.
       if (faulty(tick) && tick % 20 < 10) state.pose.position.x() += 0.05;
     }},
    {"freezes", ServoEventKind::kDeviceFrozen,
     [last = DeviceState()](DeviceState& state, std::uint64_t tick) mutable {
       if (faulty(tick)) {
         state = last;
       } else {
         last = state;
       }
     }},
    {"sends NaN", ServoEventKind::kDeviceNotFinite,
     [](DeviceState& state, std::uint64_t tick) {
       if (faulty(tick)) state.pose.position.y() = std::numeric_limits<double>::quiet_NaN();
     }},
    {"sends an orientation that is none", ServoEventKind::kDeviceNotFinite,
     [](DeviceState& state, std::uint64_t tick) {
       if (faulty(tick)) state.pose.orientation.coeffs().setZero();
     }},
    {"is pulled out", ServoEventKind::kDeviceLost,
     [](DeviceState& state, std::uint64_t tick) {
       if (!faulty(tick)) return;
       state.connected = false;
       state.pose.position.setConstant(std::numeric_limits<double>::infinity());
     }},
    {"reads outside its work space", ServoEventKind::kDeviceOutside,
     [](DeviceState& state, std::uint64_t tick) {
       if (faulty(tick)) state.pose.position.z() = -0.5;
     }},
};

INSTANTIATE_TEST_SUITE_P(Haptics, MisbehavingDevice, testing::ValuesIn(kCases));

TEST(MisbehavingTissue, ForceThatIsNotFiniteNeverReachesTheHand) {
  class BrokenWall : public VirtualWall {
   public:
    TactileForce respond(const ToolMotion& motion, double dt) noexcept override {
      TactileForce out = VirtualWall::respond(motion, dt);
      if (motion.tick >= kFault && motion.tick < kMended)
        out.force.x() = std::numeric_limits<double>::quiet_NaN();
      return out;
    }
  } wall;
  wall.stiffness = 300.0;
  SimulatedDeviceSettings settings;
  settings.path = path_along_z({{0.4, 0.02}, {0.9, -0.02}});
  SimulatedDevice device(settings);
  ServoTick servo(device, wall, {});
  for (const ServoOutput& out : run_ticks(servo, 0, kEnd)) ASSERT_TRUE(out.force.allFinite());
  EXPECT_TRUE(has_event(take_events(servo.events()), ServoEventKind::kTissueNotFinite));
  EXPECT_GT(servo.output().force.z(), 1.0);
}

TEST(MisbehavingDevice, ASpikeOfOneTickIsReportedAndNotFollowed) {
  SimulatedDeviceSettings settings;
  settings.path = path_along_z({{0.4, 0.02}, {0.9, -0.02}});
  SimulatedDevice inner(settings);
  WatchedDevice device(inner, [](DeviceState& state, std::uint64_t tick) {
    if (tick == kFault) state.pose.position.z() -= 0.03;
  });
  VirtualWall wall = wall_at_zero(300.0);
  ServoTick servo(device, wall, {});
  EXPECT_LT(greatest_step(run_ticks(servo, 0, kEnd)), 0.2);
  EXPECT_TRUE(has_event(take_events(servo.events()), ServoEventKind::kDeviceJumped));
}

TEST(ServoEvents, AFullRingCountsWhatItDrops) {
  ServoEventRing ring;
  for (std::uint32_t i = 0; i < ServoEventRing::kSlots + 5; ++i) ring.push({i, {}, 0.0});
  EXPECT_EQ(ring.dropped(), 5u);
  const auto events = take_events(ring);
  ASSERT_EQ(events.size(), ServoEventRing::kSlots);
  EXPECT_EQ(events.front().tick, 0u);
  ring.push({7, {}, 0.0});
  EXPECT_EQ(take_events(ring).size(), 1u);
}

TEST(ServoEvents, EachKindHasASentence) {
  for (int kind = 0; kind <= static_cast<int>(ServoEventKind::kTickStuck); ++kind) {
    const std::string text = describe({12, static_cast<ServoEventKind>(kind), 1.0});
    EXPECT_EQ(text.find("without a name"), std::string::npos) << kind;
    EXPECT_TRUE(text.starts_with("tick 12: ")) << text;
  }
}

}  // namespace
}  // namespace viscera::test
