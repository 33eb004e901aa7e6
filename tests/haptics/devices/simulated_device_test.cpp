#include "haptics/devices/simulated_device.h"

#include <gtest/gtest.h>

#include <cmath>

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

/// [m/s] of a handle that nobody holds, after a tenth of a second under a force.
double pushed(double friction, double force) {
  SimulatedDeviceSettings settings = held_at_rest(0.0);
  settings.hand = {};
  settings.limits.apparent_mass = 0.08;
  settings.limits.friction = friction;
  SimulatedDevice device(settings);
  for (std::uint64_t tick = 0; tick < 100; ++tick) {
    device.read(tick);
    device.write(Vec3(force, 0.0, 0.0));
  }
  device.read(100);
  return device.velocity().x();
}

TEST(SimulatedDevice, AHandleThatNobodyHoldsGainsSpeedByForceAndMassAndLosesItsFriction) {
  // 0.1 N on 80 g for 0.1 s.
  EXPECT_NEAR(pushed(0.0, 0.1), 0.125, 1e-12);
  EXPECT_NEAR(pushed(0.04, 0.1), 0.06 * 0.1 / 0.08, 1e-12);
  EXPECT_EQ(pushed(0.04, 0.03), 0.0);
}

TEST(SimulatedDevice, ItsImplicitStepsTakeNoMoreThanAsADamperOfStepTimesStiffness) {
  SimulatedDeviceSettings settings = held_at_rest(0.0);
  settings.hand = {0.2, 1000.0, 0.0};
  settings.limits.apparent_mass = 0.05;
  settings.limits.friction = 0.0;
  SimulatedDevice device(settings);
  // Swings about where the spring bears 5 N, from 5 mm beside: 12.5 mJ.
  for (std::uint64_t tick = 0; tick < 1000; ++tick) {
    device.read(tick);
    device.write(Vec3(5.0, 0.0, 0.0));
  }
  device.read(1000);
  const double beside = device.position().x() - 5e-3;
  const double left = 0.5 * 0.25 * device.velocity().squaredNorm() + 0.5 * 1000.0 * beside * beside;
  // Backward Euler leaves 1 / (1 + h^2 k / m) a step, of ten thousand.
  EXPECT_NEAR(left / 12.5e-3, std::pow(1.0 + 1e-8 * 1000.0 / 0.25, -10'000), 5e-3);
}

TEST(Hand, GripsGoFromTwoFingertipsToAFistGeometrically) {
  const Hand loose = Hand::with_grip(0.0), between = Hand::with_grip(0.5),
             fist = Hand::with_grip(1);
  EXPECT_DOUBLE_EQ(loose.mass, 0.02);
  EXPECT_DOUBLE_EQ(loose.stiffness, 30.0);
  EXPECT_DOUBLE_EQ(loose.damping, 0.5);
  EXPECT_DOUBLE_EQ(fist.mass, 0.2);
  EXPECT_DOUBLE_EQ(fist.stiffness, 1000.0);
  EXPECT_DOUBLE_EQ(fist.damping, 12.0);
  EXPECT_NEAR(between.stiffness, std::sqrt(30.0 * 1000.0), 1e-9);
  EXPECT_NEAR(between.damping, std::sqrt(0.5 * 12.0), 1e-12);
}

TEST(HandPath, ItLeavesAKeyFromWhereThatIs) {
  const HandPath path = path_along_z({{0.0, 0.1}, {1.0, 0.3}});
  EXPECT_NEAR(path.at(0.5).pose.position.z(), 0.2, 1e-12);
  // The peak speed of a movement of least jerk is 15/8 of its mean.
  EXPECT_NEAR(path.at(0.5).velocity.z(), 0.2 * 15.0 / 8.0, 1e-12);
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
