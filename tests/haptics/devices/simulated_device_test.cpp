#include "haptics/devices/simulated_device.h"

#include <gtest/gtest.h>

#include "tests/haptics/servo_world.h"

namespace viscera::test {
namespace {

SimulatedDeviceSettings held_at_rest(double grip) {
  SimulatedDeviceSettings settings;
  settings.hand = Hand::with_grip(grip);
  settings.path = path_along_z({{0.0, 0.0}});
  return settings;
}

TEST(SimulatedDevice, TheHandYieldsToALastingForceAsItsSpringSays) {
  for (const double grip : {0.0, 0.5, 1.0}) {
    SimulatedDevice device(held_at_rest(grip));
    const double force = 0.005 * Hand::with_grip(grip).stiffness;  // for 5 mm
    for (std::uint64_t tick = 0; tick < 4000; ++tick) {
      device.read(tick);
      device.write(Vec3(force, 0.0, 0.0));
    }
    const double stuck = device.limits().friction / Hand::with_grip(grip).stiffness;
    EXPECT_NEAR(device.position().x(), 0.005, stuck + 1e-6) << grip;
    EXPECT_LT(device.velocity().norm(), 1e-9) << grip;
  }
}

TEST(SimulatedDevice, AFirmerGripYieldsLess) {
  double last = 1.0;
  for (const double grip : {0.0, 0.25, 0.5, 0.75, 1.0}) {
    SimulatedDevice device(held_at_rest(grip));
    for (std::uint64_t tick = 0; tick < 3000; ++tick) {
      device.read(tick);
      device.write(Vec3(0.5, 0.0, 0.0));
    }
    EXPECT_LT(device.position().x(), last);
    last = device.position().x();
  }
}

TEST(SimulatedDevice, AForceBelowItsFrictionDoesNotMoveIt) {
  SimulatedDevice device(held_at_rest(0.0));
  for (std::uint64_t tick = 0; tick < 1000; ++tick) {
    device.read(tick);
    device.write(Vec3(0.0, 0.9 * device.limits().friction, 0.0));
  }
  EXPECT_EQ(device.position(), Vec3::Zero());
}

TEST(SimulatedDevice, ItsPositionsAreWholeStepsOfTheEncoders) {
  SimulatedDeviceSettings settings;
  settings.path = path_along_z({{0.0, 0.0}, {0.5, 0.03}});
  SimulatedDevice device(settings);
  for (std::uint64_t tick = 0; tick < 700; ++tick) {
    const double steps = device.read(tick).pose.position.z() / device.limits().resolution;
    EXPECT_NEAR(steps, std::round(steps), 1e-9);
    EXPECT_NEAR(steps * device.limits().resolution, device.position().z(),
                0.5001 * device.limits().resolution);
  }
}

TEST(SimulatedDevice, ItStopsAtTheEndOfItsWorkSpace) {
  SimulatedDeviceSettings settings;
  settings.path = path_along_z({{0.0, 0.0}, {0.5, 0.2}});
  SimulatedDevice device(settings);
  for (std::uint64_t tick = 0; tick < 1000; ++tick) device.read(tick);
  EXPECT_EQ(device.position().z(), device.limits().work_space.max().z());
}

TEST(SimulatedDevice, ItsMotorsGiveNoMoreThanTheirPeak) {
  const auto moved = [](double force) {
    SimulatedDevice device(held_at_rest(1.0));
    for (std::uint64_t tick = 0; tick < 2000; ++tick) {
      device.read(tick);
      device.write(Vec3(force, 0.0, 0.0));
    }
    return device.position().x();
  };
  EXPECT_EQ(moved(100.0), moved(phantom_premium_1_0a().peak_force));
}

TEST(SimulatedDevice, TicksThatALateLoopMissedHaveStillPassed) {
  SimulatedDeviceSettings settings;
  settings.path = path_along_z({{0.0, 0.0}, {0.5, 0.03}});
  SimulatedDevice prompt(settings), late(settings);
  for (std::uint64_t tick = 0; tick <= 300; ++tick) prompt.read(tick);
  late.read(0);
  EXPECT_EQ(late.read(300).pose.position, prompt.read(300).pose.position);
}

TEST(HandPath, ItRestsAtItsKeysAndMovesWithLeastJerkBetween) {
  const HandPath path = path_along_z({{1.0, 0.0}, {2.0, 0.1}, {3.0, 0.1}});
  EXPECT_EQ(path.at(0.0).pose.position.z(), 0.0);
  EXPECT_EQ(path.at(9.0).pose.position.z(), 0.1);
  EXPECT_NEAR(path.at(1.5).pose.position.z(), 0.05, 1e-12);
  EXPECT_NEAR(path.at(1.5).velocity.z(), 0.1 * 15.0 / 8.0, 1e-12);
  for (const double t : {1.2, 1.7}) {
    const double h = 1e-5;
    const double slope =
        (path.at(t + h).pose.position.z() - path.at(t - h).pose.position.z()) / (2.0 * h);
    EXPECT_NEAR(path.at(t).velocity.z(), slope, 1e-7);
  }
}

}  // namespace
}  // namespace viscera::test
