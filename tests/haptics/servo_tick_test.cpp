#include "haptics/servo_tick.h"

#include <gtest/gtest.h>

#include <bit>

#include "tests/haptics/allocations.h"
#include "tests/haptics/servo_world.h"
#include "tests/haptics/watched_device.h"

namespace viscera::test {
namespace {

SimulatedDevice pressing_device(double depth, double grip = 0.5) {
  SimulatedDeviceSettings settings;
  settings.hand = Hand::with_grip(grip);
  settings.path = path_along_z({{0.4, 0.02}, {0.9, -depth}});
  return SimulatedDevice(settings);
}

TEST(ServoTick, InTheAirNoForceIsFeltAndTheToolIsWhereTheDeviceIs) {
  SimulatedDevice device = pressing_device(-0.005);  // stops above the wall
  VirtualWall wall = wall_at_zero(500.0);
  ServoTick servo(device, wall, {});
  const auto outputs = run_ticks(servo, 0, 1500);
  for (const ServoOutput& out : outputs) {
    EXPECT_EQ(out.force, Vec3::Zero());
    EXPECT_EQ(out.tool.position, out.device.position);
  }
  EXPECT_LT(std::abs(outputs.back().device.position.z() - 0.005), 0.001);
}

TEST(ServoTick, PressingTissueTheHandFeelsTheTissuesForceAtTheToolsPlace) {
  SimulatedDevice device = pressing_device(0.01);
  VirtualWall wall = wall_at_zero(300.0);
  ServoTick servo(device, wall, {});
  const ServoOutput out = run_ticks(servo, 0, 3000).back();
  EXPECT_TRUE(out.touching);
  EXPECT_NEAR(out.force.z(), -300.0 * out.tool.position.z(), 1e-9);
  EXPECT_NEAR(out.force.z(), out.tissue.z(), 1e-9);
  // The hand's spring, the coupling's and the tissue's in a row, but for friction and the encoders.
  const double hand = Hand::with_grip(0.5).stiffness,
               coupling = servo.settings().coupling.stiffness;
  const double all = 1.0 / (1.0 / hand + 1.0 / coupling + 1.0 / 300.0);
  EXPECT_NEAR(out.force.z(), all * 0.01, device.limits().friction + hand * 30e-6);
  EXPECT_EQ(servo.passivity_violations(), 0u);
}

TEST(ServoTick, APlacedDeviceFeelsTheSceneFromItsOwnFrame) {
  SimulatedDeviceSettings settings;
  settings.path = path_along_z({{0.4, 0.02}, {0.9, -0.01}});
  SimulatedDevice device(settings);
  ServoSettings servo_settings;
  servo_settings.placement.position = Vec3(0.1, 0.2, 0.3);
  // The device's z is the scene's x.
  servo_settings.placement.orientation = Quaternion::FromTwoVectors(Vec3::UnitZ(), Vec3::UnitX());
  VirtualWall wall = wall_at_zero(300.0);
  wall.place = servo_settings.placement.position;
  wall.normal = Vec3::UnitX();
  ServoTick servo(device, wall, servo_settings);
  const ServoOutput out = run_ticks(servo, 0, 3000).back();
  EXPECT_GT(out.force.x(), 0.5);
  EXPECT_LT(std::abs(device.position().z()), 0.01);
  EXPECT_LT(out.tool.position.x(), 0.1);
}

TEST(ServoTick, TheSameTicksGiveTheSameForcesBitForBit) {
  const auto forces = [] {
    SimulatedDevice device = pressing_device(0.01, 0.2);
    VirtualWall wall = wall_at_zero(800.0, 1.0);
    ServoTick servo(device, wall, {});
    std::vector<std::uint64_t> bits;
    for (const ServoOutput& out : run_ticks(servo, 0, 2000))
      for (const double f : out.force) bits.push_back(std::bit_cast<std::uint64_t>(f));
    return bits;
  };
  EXPECT_EQ(forces(), forces());
}

TEST(ServoTick, ATickTakesNothingFromTheHeap) {
  if (!allocations_are_counted()) GTEST_SKIP() << "sanitizers have a heap of their own";
  SimulatedDevice inner = pressing_device(0.01);
  // With a fault on the way, so that events are written too.
  WatchedDevice device(inner, [](DeviceState& state, std::uint64_t tick) {
    if (tick > 1500 && tick < 1600) state.connected = false;
  });
  VirtualWall wall = wall_at_zero(800.0);
  ServoTick servo(device, wall, {});
  TickTimes times;
  const std::uint64_t before = allocations();
  for (std::uint64_t tick = 0; tick < 2500; ++tick) servo.run(tick, &times);
  EXPECT_EQ(allocations(), before);
  EXPECT_TRUE(has_event(take_events(servo.events()), ServoEventKind::kDeviceLost));
}

TEST(ServoTick, TimesOfThePartsAreThoseOfTheTick) {
  SimulatedDevice device = pressing_device(0.01);
  class SlowTissue : public TactileModel {
    TactileForce respond(const ToolMotion&, double) noexcept override {
      const auto until = std::chrono::steady_clock::now() + std::chrono::milliseconds(2);
      while (std::chrono::steady_clock::now() < until) {
      }
      return {};
    }
  } tissue;
  ServoTick servo(device, tissue, {});
  run_ticks(servo, 0, 200);
  TickTimes times;
  servo.run(200, &times);
  EXPECT_GE(times[static_cast<std::size_t>(TickPart::kTissue)], 2'000'000u);
}

TEST(ServoTick, AfterReleaseTheForceFadesAndStaysAway) {
  SimulatedDevice device = pressing_device(0.01);
  VirtualWall wall = wall_at_zero(500.0);
  ServoTick servo(device, wall, {});
  ASSERT_GT(run_ticks(servo, 0, 2000).back().force.norm(), 0.5);
  servo.release();
  const auto after = run_ticks(servo, 2000, 3000);
  EXPECT_TRUE(servo.released());
  EXPECT_EQ(after.back().force, Vec3::Zero());
  EXPECT_GT(after.front().force.norm(), 0.5);
  EXPECT_LT(greatest_step(after), 0.1);
}

}  // namespace
}  // namespace viscera::test
