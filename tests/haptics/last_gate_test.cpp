// What stands between a device and a force that should never have come about.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>

#include "kernels/base/finite.h"
#include "tests/haptics/servo_world.h"
#include "tests/haptics/watched_device.h"

namespace viscera::test {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// Everything that goes from tick to tick and becomes a force.
bool clean(const ServoTick& servo) {
  const ServoTick::State state = servo.state();
  return !first_stray(state.coupling) && !first_stray(state.passivity) &&
         !first_stray(state.limits) && !first_stray(state.output) &&
         !first_stray(state.greatest_force) && !first_stray(state.tool_before) &&
         !first_stray(state.fading);
}

/// A wall whose answer a test may break.
class BrokenWall : public VirtualWall {
 public:
  std::function<void(TactileForce&, const ToolMotion&)> how;
  TactileForce respond(const ToolMotion& motion, double dt) noexcept override {
    TactileForce felt = VirtualWall::respond(motion, dt);
    how(felt, motion);
    return felt;
  }
};

TEST(LastGate, AForceThatIsNoNumberIsNotWrittenButZeroAndAnEventTells) {
  SimulatedDevice inner(pressing());
  WatchedDevice device(inner);
  device.limits_.friction = kNaN;  // gets through the energy watch into the force
  VirtualWall wall = wall_at_zero(500.0);
  ServoTick servo(device, wall, {});
  std::uint64_t spoilt = 0;
  for (std::uint64_t tick = 0; tick < 2000; ++tick) {
    const ServoOutput& out = servo.run(tick);
    ASSERT_TRUE(clean(servo)) << tick;
    for (const ServoEvent& event : take_events(servo.events())) {
      if (event.kind != ServoEventKind::kForceNotFinite) continue;
      ++spoilt;
      EXPECT_EQ(out.force, Vec3::Zero());
      EXPECT_EQ(device.last, 0.0);
    }
  }
  EXPECT_GT(spoilt, 1u) << "again after it has come back";
  EXPECT_GT(device.greatest, 0.0);
  EXPECT_EQ(device.not_finite, 0u);
  servo.release();
  run_ticks(servo, 2000, 2100);
  EXPECT_TRUE(servo.released());
  EXPECT_EQ(servo.output().force, Vec3::Zero());
}

TEST(LastGate, AForceAboveThePeakInTheDevicesFrameIsNotWritten) {
  SimulatedDevice inner(pressing());
  WatchedDevice device(inner);
  SteadyPush push(Vec3(0.0, 0.0, 3.0));
  ServoSettings settings;
  // Five times as long in the device's frame.
  settings.placement.orientation.coeffs() = Vec4(std::sqrt(2.0), 0.0, 0.0, std::sqrt(2.0));
  ServoTick servo(device, push, settings);
  run_ticks(servo, 0, 1000);
  const auto events = take_events(servo.events());
  EXPECT_TRUE(has_event(events, ServoEventKind::kForceTooLarge));
  EXPECT_GT(device.greatest, 5.0);
  EXPECT_LE(device.greatest, inner.limits().peak_force * (1.0 + 1e-9));
}

TEST(LastGate, LimitsThatAreNoNumbersAllowNoForce) {
  SimulatedDevice inner(pressing());
  WatchedDevice device(inner);
  device.limits_.peak_force = kNaN;
  VirtualWall wall = wall_at_zero(500.0);
  ServoTick servo(device, wall, {});
  run_ticks(servo, 0, 1500);
  EXPECT_EQ(device.greatest, 0.0);
  EXPECT_TRUE(has_event(take_events(servo.events()), ServoEventKind::kForceTooLarge));
}

TEST(LastGate, ItJudgesByThePeakAndWhereMotorsAreHotByTheContinuousForce) {
  DeviceLimits limits = phantom_premium_1_0a();
  ForceLimits gate({}, limits, 1e-3);
  using Verdict = ForceLimits::Verdict;
  const auto along_x = [](double size) { return Vec3(size, 0.0, 0.0); };
  EXPECT_EQ(gate.judge(Vec3::Zero()), Verdict::kSound);
  EXPECT_EQ(gate.judge(along_x(limits.peak_force)), Verdict::kSound);
  EXPECT_EQ(gate.judge(along_x(limits.peak_force * 1.001)), Verdict::kTooLarge);
  EXPECT_EQ(gate.judge(along_x(kNaN)), Verdict::kNotFinite);
  EXPECT_EQ(gate.judge(along_x(-kInfinity)), Verdict::kNotFinite);
  ForceLimits::State state;
  for (const double heat : {2.0 * limits.continuous_force * limits.continuous_force, kNaN}) {
    state.mean_square = heat;
    gate.restore(state);
    EXPECT_EQ(gate.judge(along_x(limits.continuous_force)), Verdict::kSound);
    EXPECT_EQ(gate.judge(along_x(1.01 * limits.continuous_force)), Verdict::kTooLarge);
  }
  limits.peak_force = kInfinity;  // then it is only a number that is asked for
  EXPECT_EQ(ForceLimits({}, limits, 1e-3).judge(along_x(kInfinity)), Verdict::kNotFinite);
}

TEST(LastGate, NoNumberGetsIntoTheForceLimitsAndTheirHeatOutlivesAReset) {
  ForceLimits limits({}, phantom_premium_1_0a(), 1e-3);
  for (int i = 0; i < 1000; ++i) limits.apply(Vec3(3.0, 0.0, 0.0));
  const double heat = limits.state().mean_square;
  EXPECT_FALSE(limits.apply(Vec3(kNaN, 0.0, 0.0)).allFinite()) << "the gate's to refuse";
  EXPECT_EQ(limits.state().force.x(), 3.0);
  limits.reset();
  EXPECT_EQ(limits.state().force, Vec3::Zero());
  EXPECT_EQ(limits.state().mean_square, heat);
  ForceLimits::State broken;
  broken.mean_square = kInfinity;
  limits.restore(broken);
  limits.reset();
  const double continuous = phantom_premium_1_0a().continuous_force;
  EXPECT_EQ(limits.state().mean_square, continuous * continuous);
}

TEST(LastGate, TissueThatMakesTheCouplingSingularIsLetGoOfSmoothlyAndFeltAgain) {
  BrokenWall wall;
  wall.stiffness = 500.0;
  const CouplingSettings coupling;
  wall.how = [&](TactileForce& felt, const ToolMotion& motion) {
    if (motion.tick == 1000)
      felt.stiffness = -(coupling.stiffness + coupling.damping / 1e-3) * Mat3::Identity();
  };
  SimulatedDevice device(pressing());
  ServoTick servo(device, wall, {});
  std::vector<ServoOutput> all;
  for (std::uint64_t tick = 0; tick < 2000; ++tick) {
    all.push_back(servo.run(tick));
    ASSERT_TRUE(clean(servo)) << tick;
  }
  EXPECT_TRUE(has_event(take_events(servo.events()), ServoEventKind::kForceNotFinite));
  EXPECT_GT(all[999].force.z(), 1.0);
  EXPECT_LT(greatest_step(all), 0.2);
  EXPECT_EQ(all[1060].force, Vec3::Zero());
  EXPECT_GT(all.back().force.z(), 1.0);
}

TEST(LastGate, TissueIsNotAskedWhereALateTickMakesTheCouplingSingular) {
  BrokenWall wall;
  wall.stiffness = 500.0;
  const CouplingSettings coupling;
  std::uint64_t nowhere = 0;
  wall.how = [&](TactileForce& felt, const ToolMotion& motion) {
    nowhere += !motion.pose.position.allFinite();
    // Singular for a tick of twice the length alone.
    if (motion.tick == 1000)
      felt.stiffness = -(coupling.stiffness + coupling.damping / 2e-3) * Mat3::Identity();
  };
  SimulatedDevice device(pressing());
  ServoTick servo(device, wall, {});
  run_ticks(servo, 0, 1001);
  EXPECT_FALSE(has_event(take_events(servo.events()), ServoEventKind::kForceNotFinite));
  servo.run(1002);
  EXPECT_TRUE(has_event(take_events(servo.events()), ServoEventKind::kForceNotFinite));
  EXPECT_EQ(nowhere, 0u);
  EXPECT_TRUE(clean(servo));
}

TEST(LastGate, TissueWhoseEnergyIsNoNumberIsLetGoOf) {
  for (const bool supplied : {false, true}) {
    for (const double value : {kNaN, kInfinity, -kInfinity}) {
      BrokenWall wall;
      wall.stiffness = 500.0;
      wall.how = [&](TactileForce& felt, const ToolMotion& motion) {
        if (motion.tick == 1000) (supplied ? felt.supplied : felt.energy) = value;
      };
      SimulatedDevice device(pressing());
      ServoTick servo(device, wall, {});
      const auto outputs = run_ticks(servo, 0, 1060);
      EXPECT_TRUE(has_event(take_events(servo.events()), ServoEventKind::kTissueNotFinite));
      EXPECT_EQ(outputs.back().force, Vec3::Zero());
      EXPECT_LT(greatest_step(outputs), 0.2);
      EXPECT_TRUE(clean(servo));
    }
  }
}

TEST(LastGate, TissueIsNotAskedAtAPlaceThatIsNone) {
  BrokenWall wall;
  wall.stiffness = 500.0;
  std::uint64_t asked = 0, nowhere = 0;
  wall.how = [&](TactileForce&, const ToolMotion& motion) {
    ++asked;
    nowhere += !motion.pose.position.allFinite();
  };
  SimulatedDevice inner(pressing());
  WatchedDevice device(inner);
  ServoSettings settings;
  settings.placement.position.x() = kNaN;
  ServoTick servo(device, wall, settings);
  for (std::uint64_t tick = 0; tick < 1000; ++tick) {
    servo.run(tick);
    ASSERT_TRUE(clean(servo)) << tick;
  }
  EXPECT_EQ(nowhere, 0u);
  EXPECT_EQ(device.greatest, 0.0);
  EXPECT_TRUE(has_event(take_events(servo.events()), ServoEventKind::kForceNotFinite));
}

TEST(LastGate, OfAForceThatIsForgottenNothingIsLeft) {
  SimulatedDevice device(pressing());
  VirtualWall wall = wall_at_zero(500.0);
  ServoTick servo(device, wall, {});
  ASSERT_GT(run_ticks(servo, 0, 1000).back().force.z(), 1.0);
  servo.forget_force();
  const ServoTick::State state = servo.state();
  EXPECT_EQ(state.coupling.stretch, Vec3::Zero());
  EXPECT_EQ(state.coupling.force, Vec3::Zero());
  EXPECT_EQ(state.limits.force, Vec3::Zero());
  EXPECT_GT(state.limits.mean_square, 0.0) << "motors stay hot";
  EXPECT_EQ(state.fading, Vec3::Zero());
  EXPECT_LT(state.passivity.stored, 0.0);
  EXPECT_EQ(state.output.force, Vec3::Zero());
}

TEST(LastGate, ATickThatFindsTheWatchdogShowsNothingAndEngagesAsAfterAFault) {
  SimulatedDevice inner(pressing());
  WatchedDevice device(inner);
  VirtualWall wall = wall_at_zero(500.0);
  ServoTick servo(device, wall, {});
  ASSERT_GT(run_ticks(servo, 0, 1000).back().force.z(), 1.0);
  take_events(servo.events());
  ASSERT_TRUE(servo.pen().take());
  const std::uint64_t writes = device.writes;
  EXPECT_EQ(servo.run(1000).force, Vec3::Zero());
  EXPECT_EQ(servo.state().fading, Vec3::Zero());
  EXPECT_EQ(device.writes, writes);
  EXPECT_TRUE(has_event(take_events(servo.events()), ServoEventKind::kTicksMissing));
  servo.pen().let_go();
  device.greatest_rise = 0.0;
  const auto after = run_ticks(servo, 1001, 2000);
  EXPECT_EQ(after[90].force, Vec3::Zero());
  EXPECT_GT(after.back().force.z(), 1.0);
  EXPECT_LT(device.greatest_rise, 0.1);
}

TEST(ServoTick, AForceThatLimitsHoldBackFadesFromWhatWasShown) {
  SimulatedDeviceSettings settings = pressing();
  settings.limits.peak_force = settings.limits.continuous_force = 1.0;
  SimulatedDevice device(settings);
  SteadyPush push(Vec3(0.0, 0.0, 10.0));
  ServoTick servo(device, push, {});
  EXPECT_NEAR(run_ticks(servo, 0, 1000).back().force.norm(), 1.0, 1e-9);
  servo.release();
  const auto after = run_ticks(servo, 1000, 1025);
  EXPECT_LT(after.back().force.norm(), 0.55);
}

}  // namespace
}  // namespace viscera::test
