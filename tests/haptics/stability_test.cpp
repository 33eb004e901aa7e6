// Contact through the whole loop: hands from loose to firm, walls from soft to rigid, closed paths.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "haptics/z_width.h"
#include "tests/haptics/servo_world.h"

namespace viscera::test {
namespace {

constexpr double kGrips[] = {0.0, 0.25, 0.5, 0.75, 1.0};

TEST(Stability, ARigidWallBehindTheDefaultCouplingIsStableFromLooseToFirmGrips) {
  const CouplingSettings coupling;
  for (const double grip : kGrips) {
    ZWidthCase trial;
    trial.grip = grip;
    trial.stiffness = coupling.stiffness;
    trial.damping = coupling.damping;
    const ZWidthTrial out = press_wall(trial);
    EXPECT_TRUE(out.stable) << "grip " << grip << ": " << out.rattle << " m/s";
    const double hand = Hand::with_grip(grip).stiffness;
    const double soft = 1.0 / hand + 1.0 / coupling.stiffness;
    const double expected = std::min(1.0, 0.03 / soft);
    // But for the device's friction and the encoders' step.
    EXPECT_NEAR(out.force, expected, 0.04 + 30e-6 * coupling.stiffness) << grip;
  }
}

TEST(Stability, TissueIsStableFromLooseToFirmGrips) {
  for (const double grip : kGrips) {
    for (const double stiffness : {50.0, 300.0, 1000.0, 5000.0}) {
      SimulatedDeviceSettings settings;
      settings.hand = Hand::with_grip(grip);
      // For 1 N, or what 3 cm carry.
      const double soft = 1.0 / settings.hand.stiffness + 1.0 / stiffness + 1.0 / 2000.0;
      settings.path = path_along_z({{0.3, 0.01}, {0.8, -std::min(0.03, 1.0 * soft)}});
      SimulatedDevice device(settings);
      VirtualWall wall = wall_at_zero(stiffness);
      ServoTick servo(device, wall, {});
      run_ticks(servo, 0, 2000);
      double fastest = 0.0;
      for (std::uint64_t tick = 2000; tick < 2500; ++tick) {
        servo.run(tick);
        fastest = std::max(fastest, device.velocity().norm());
      }
      EXPECT_LT(fastest, 2e-3) << "grip " << grip << ", " << stiffness << " N/m";
    }
  }
}

TEST(Stability, ThereIsAStiffnessAboveWhichWallsRattleAndDampingMovesIt) {
  // Without the controller, or there would be no edge to find.
  ZWidthCase trial;
  trial.passivity = false;
  trial.grip = 0.0;
  const double undamped = greatest_stable_stiffness(trial);
  trial.damping = 2.0;
  const double damped = greatest_stable_stiffness(trial);
  EXPECT_GT(undamped, 100.0);
  EXPECT_LT(undamped, 1e5);
  EXPECT_GT(damped, undamped);
}

TEST(Stability, ThePassivityControllerWidensWhatALooseHandCanTouchUndamped) {
  ZWidthCase trial;
  trial.grip = 0.0;
  trial.passivity = false;
  const double without = greatest_stable_stiffness(trial);
  trial.passivity = true;
  EXPECT_GT(greatest_stable_stiffness(trial), 1.5 * without);
}

TEST(Stability, TheDefaultCouplingKeepsHalfOfWhatIsStableInReserve) {
  const CouplingSettings coupling;
  for (const double grip : kGrips) {
    ZWidthCase trial;
    trial.grip = grip;
    trial.damping = coupling.damping;
    EXPECT_GT(greatest_stable_stiffness(trial), 2.0 * coupling.stiffness) << grip;
  }
}

TEST(Passivity, ClosedPathsGiveBackNoEnergy) {
  // A hand that slides in and out of a ball and around in it, back to where it began, many times.
  for (const double grip : kGrips) {
    SimulatedDeviceSettings settings;
    settings.hand = Hand::with_grip(grip);
    for (int i = 0; i < 12; ++i) {
      HandPath::Key key;
      key.time = 0.4 + 0.25 * i;
      const double angle = 2.0 * std::numbers::pi * i / 4.0;
      key.pose.position = Vec3(0.01 * std::cos(angle), 0.01 * std::sin(angle), i % 3 ? 0.01 : 0.04);
      settings.path.keys.push_back(key);
    }
    HandPath::Key last = settings.path.keys.front();
    last.time = 4.0;
    settings.path.keys.push_back(last);
    SimulatedDevice device(settings);
    VirtualBall ball;
    ball.radius = 0.03;
    ball.stiffness = 400.0;
    ServoTick servo(device, ball, {});
    double most_stored = 0.0, given = 0.0;
    Vec3 before = device.position(), held = Vec3::Zero();
    for (std::uint64_t tick = 0; tick < 5000; ++tick) {
      const Vec3 next = servo.run(tick).force;
      most_stored = std::max(most_stored, 0.5 * next.squaredNorm() / 400.0);
      // By where the handle really is, not by its encoders.
      given += held.dot(device.position() - before);
      before = device.position();
      held = next;
    }
    EXPECT_FALSE(servo.output().touching);
    EXPECT_GT(most_stored, 0.001) << "the path touches";
    // But for what one step of the encoders is under the greatest force.
    const double unknown = device.limits().resolution * std::sqrt(2.0 * 400.0 * most_stored);
    EXPECT_LT(given, unknown) << "grip " << grip;
    EXPECT_LT(servo.energy_given(), unknown) << "grip " << grip;
    EXPECT_EQ(servo.passivity_violations(), 0u) << grip;
  }
}

/// A wall that gives back more than it got: 30 % stiffer on the way out.
class ActiveWall : public VirtualWall {
 public:
  TactileForce respond(const ToolMotion& motion, double dt) noexcept override {
    TactileForce out = VirtualWall::respond(motion, dt);
    if (motion.velocity.z() > 0.0) out.force *= 1.3;
    return out;
  }
};

struct Given {
  double energy = 0.0;  ///< [J]
  std::uint64_t violations = 0;
};

/// What a hand that goes in and out of an active wall is given.
Given given_by_active_wall(bool control, const ServoSettings& base = {},
                           double peak = phantom_premium_1_0a().peak_force) {
  SimulatedDeviceSettings settings;
  settings.limits.peak_force = peak;
  for (int i = 0; i < 10; ++i) {
    HandPath::Key key;
    key.time = 0.4 + 0.2 * i;
    key.pose.position.z() = i % 2 ? -0.01 : 0.005;
    settings.path.keys.push_back(key);
  }
  SimulatedDevice device(settings);
  ActiveWall wall;
  wall.stiffness = 300.0;
  ServoSettings servo_settings = base;
  servo_settings.passivity.control = control;
  ServoTick servo(device, wall, servo_settings);
  run_ticks(servo, 0, 2600);
  return {servo.energy_given(), servo.passivity_violations()};
}

TEST(Passivity, AnActiveWallIsSeenAndItsEnergyTaken) {
  const Given without = given_by_active_wall(false), with = given_by_active_wall(true);
  EXPECT_GT(without.energy, 0.0);
  EXPECT_GT(without.violations, 100u);
  EXPECT_LT(with.energy, 0.5 * without.energy);
  EXPECT_LT(with.violations, without.violations);
}

TEST(Passivity, AForceThatFadesInIsWatchedToo) {
  ServoSettings settings;
  settings.guard.engage_time = 5.0;  // never all of it
  const double without = given_by_active_wall(false, settings, 8.5).energy;
  EXPECT_GT(without, 0.0);
  EXPECT_LT(given_by_active_wall(true, settings, 8.5).energy, 0.5 * without);
}

TEST(Passivity, AForceThatIsLimitedIsWatchedToo) {
  ServoSettings settings;
  settings.force.rise_time = 0.5;  // it follows slowly, and so gives back what it never got
  const double without = given_by_active_wall(false, settings, 4.0).energy;
  EXPECT_GT(without, 0.0);
  EXPECT_LT(given_by_active_wall(true, settings, 4.0).energy, 0.7 * without);
}

TEST(Passivity, AForceThatFadesOutGivesBackWhatWasStoredAndNotMuchMore) {
  const auto given = [](bool control) {
    SimulatedDeviceSettings settings;
    settings.hand = Hand::with_grip(0.0);
    settings.path = path_along_z({{0.2, 0.01}, {0.6, -0.02}, {1.0, -0.02}, {1.4, 0.02}});
    SimulatedDevice device(settings);
    VirtualWall wall = wall_at_zero(5000.0);
    ServoSettings servo_settings;
    servo_settings.guard.fade_time = 2.0;
    servo_settings.passivity.control = control;
    ServoTick servo(device, wall, servo_settings);
    run_ticks(servo, 0, 1000);
    const double before = servo.energy_given();
    servo.release();
    // The hand goes out while the force still pushes it.
    double most = 0.0;
    for (std::uint64_t tick = 1000; tick < 3100; ++tick) {
      servo.run(tick);
      most = std::max(most, servo.energy_given() - before);
    }
    EXPECT_EQ(servo.output().force, Vec3::Zero());
    return most;
  };
  const double without = given(false), with = given(true);
  EXPECT_GT(without, 0.0);
  EXPECT_LT(with, 0.7 * without) << without;
}

TEST(Passivity, AForceThatIsHeldBackEarnsNothingForLater) {
  const Vec3 held(1.0, 0.0, 0.0), pushed(-1e-3, 0.0, 0.0);  // the hand does a millijoule
  for (const bool full : {true, false}) {
    PassivityGuard guard({}, phantom_premium_1_0a(), 1e-3);
    guard.reset(Vec3::Zero());
    guard.update(Vec3::Zero(), {Vec3::Zero(), 0.0, 0.0, 1e-3, full});
    guard.update(held, {pushed, 0.0, 0.0, 1e-3, full});
    EXPECT_EQ(guard.state().budget > 0.0, full);
  }
}

TEST(Passivity, WhileNobodyKnowsWhereTheDeviceIsNothingIsBooked) {
  PassivityGuard guard({}, phantom_premium_1_0a(), 1e-3);
  guard.reset(Vec3::Zero());
  const Vec3 held(1.0, 0.0, 0.0);
  guard.fade(held, Vec3(1e-3, 0.0, 0.0), 1e-3);
  EXPECT_DOUBLE_EQ(guard.given(), 1e-3);
  guard.lose_sight();
  EXPECT_EQ(guard.fade(held, Vec3(0.5, 0.0, 0.0), 1e-3), Vec3::Zero());
  EXPECT_DOUBLE_EQ(guard.given(), 1e-3) << "a jump is no work";
}

TEST(Passivity, TissueThatTheSceneMovesMayPushTheHand) {
  // A breath of 4 mm against a hand at rest: work is done on it, and nothing is wrong.
  class BreathingWall : public VirtualWall {
   public:
    TactileForce respond(const ToolMotion& motion, double dt) noexcept override {
      const double before = place.z();
      place.z() =
          0.002 * std::sin(2.0 * std::numbers::pi * 0.3 * 1e-3 * static_cast<double>(motion.tick));
      TactileForce out = VirtualWall::respond(motion, dt);
      out.supplied = out.force.z() * (place.z() - before);
      return out;
    }
  } wall;
  wall.stiffness = 300.0;
  SimulatedDeviceSettings settings;
  settings.path = path_along_z({{0.3, 0.01}, {0.8, -0.005}});
  SimulatedDevice device(settings);
  ServoTick servo(device, wall, {});
  const auto outputs = run_ticks(servo, 0, 8000);
  EXPECT_EQ(servo.passivity_violations(), 0u);
  double damped = 0.0;
  for (const ServoOutput& out : outputs) damped += out.damping * 1e-3;
  EXPECT_LT(damped, 0.01) << "[N s/m] seconds: hardly ever at work";
}

}  // namespace
}  // namespace viscera::test
