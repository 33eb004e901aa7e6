// A late loop skips ticks: everything that depends on time knows how many.
#include <gtest/gtest.h>

#include <cmath>

#include "haptics/passivity.h"
#include "tests/haptics/servo_world.h"
#include "tests/haptics/watched_device.h"

namespace viscera::test {
namespace {

/// Runs every `step`th tick.
std::vector<ServoOutput> run_every(ServoTick& servo, std::uint64_t step, std::uint64_t end) {
  std::vector<ServoOutput> all;
  for (std::uint64_t tick = step; tick <= end; tick += step) all.push_back(servo.run(tick));
  return all;
}

constexpr double kSpeed = 0.02;

TEST(SkippedTicks, TissueIsToldHowMuchTimeHasPassedAndHowFastTheToolIs) {
  class Asked : public TactileModel {
   public:
    TactileForce respond(const ToolMotion& motion, double dt) noexcept override {
      last = motion;
      time = dt;
      return {};
    }
    ToolMotion last;
    double time = 0.0;
  } tissue;
  for (const std::uint64_t step : {1u, 3u}) {
    SteadyDevice device(-0.02, kSpeed);
    ServoTick servo(device, tissue, {});
    run_every(servo, step, 600);
    EXPECT_EQ(tissue.last.ticks, step);
    EXPECT_DOUBLE_EQ(tissue.time, 1e-3 * static_cast<double>(step));
    EXPECT_NEAR(tissue.last.velocity.z(), kSpeed, 1e-6);
  }
}

TEST(SkippedTicks, TheCouplingsDamperGoesByTheTrueSpeed) {
  const auto force = [](std::uint64_t step) {
    SteadyDevice device(0.02, -kSpeed);
    VirtualWall wall = wall_at_zero(1e7);
    ServoSettings settings;
    settings.coupling = {1.0, 30.0};
    settings.passivity.control = false;
    ServoTick servo(device, wall, settings);
    return run_every(servo, step, 1500).back().force.z();
  };
  EXPECT_NEAR(force(1), 30.0 * kSpeed, 0.02);
  EXPECT_NEAR(force(3), force(1), 0.02);
}

TEST(SkippedTicks, TheEnergyWatchSeesTheTrueVelocity) {
  SteadyDevice device(0.02, -kSpeed);
  VirtualWall wall = wall_at_zero(0.0);
  ServoTick servo(device, wall, {});
  run_every(servo, 3, 900);
  EXPECT_NEAR(servo.state().passivity.velocity.z(), -kSpeed, 1e-6);
}

TEST(SkippedTicks, TheDamperTakesWhatIsMissingWithinATickAsLong) {
  PassivitySettings settings;
  settings.greatest_share = 1e6;
  const DeviceLimits limits = phantom_premium_1_0a();
  for (const double dt : {1e-3, 4e-3}) {
    PassivityGuard guard(settings, limits, 1e-3);
    guard.reset(Vec3::Zero());
    // A millimetre under 1 N with nothing stored: 1 mJ too much.
    const Vec3 moved(1e-3, 0.0, 0.0), held(1.0, 0.0, 0.0);
    guard.update(Vec3::Zero(), {Vec3::Zero(), 0.0, 0.0, dt, true});
    const Vec3 damper = guard.update(held, {moved, 0.0, 0.0, dt, true});
    const Vec3 velocity = guard.state().velocity;
    EXPECT_NEAR(-damper.dot(velocity) * dt, 1e-3, 1e-9) << dt;
    EXPECT_NEAR(velocity.x(),
                (1.0 - std::exp(-2.0 * M_PI * settings.velocity_cut * dt)) * 1e-3 / dt, 1e-9);
  }
}

TEST(SkippedTicks, MotorsHeatForAsLongAsTheForceWasHeld) {
  ForceLimits each({}, phantom_premium_1_0a(), 1e-3), some({}, phantom_premium_1_0a(), 1e-3);
  const Vec3 force(2.0, 0.0, 0.0);
  for (int i = 0; i < 2; ++i) {
    each.apply(force);
    some.apply(force);
  }
  for (int i = 0; i < 20; ++i) each.apply(force);
  for (int i = 0; i < 2; ++i) some.apply(force, 10);
  EXPECT_NEAR(some.state().mean_square, each.state().mean_square, 1e-12);
}

TEST(SkippedTicks, MotorsOfALateLoopAreAsHotAsOfOneInTime) {
  const auto heat = [](std::uint64_t step) {
    SteadyDevice device(-0.02, kSpeed);
    SteadyPush push(Vec3::UnitZ());
    ServoSettings settings;
    settings.guard.settle_time = settings.guard.engage_time = 1e-3;
    settings.passivity.control = false;
    ServoTick servo(device, push, settings);
    run_every(servo, step, 2000);
    return servo.state().limits.mean_square;
  };
  EXPECT_NEAR(heat(10), heat(1), 0.05 * heat(1));
}

TEST(EnergyWatch, WhatTheDeviceDidWhileItWasAwayIsNoWork) {
  SteadyDevice inner(-0.03, 0.05);
  const auto away = [](std::uint64_t tick) { return tick >= 1000 && tick < 1020; };
  WatchedDevice device(
      inner, [&](DeviceState& state, std::uint64_t tick) { state.connected = !away(tick); });
  SteadyPush push(Vec3::UnitZ());
  ServoSettings settings;
  settings.passivity.control = false;
  ServoTick servo(device, push, settings);
  run_ticks(servo, 0, 1020);
  const double before = servo.energy_given();
  EXPECT_GT(servo.run(1020).force.z(), 0.4) << "it still fades";
  EXPECT_LT(servo.energy_given() - before, 0.1e-3);
}

TEST(SkippedTicks, AFadingForceFallsByTheTimeThatHasPassed) {
  SimulatedDevice device(pressing());
  VirtualWall wall = wall_at_zero(500.0);
  ServoTick servo(device, wall, {});
  run_ticks(servo, 0, 1000);
  servo.release();
  servo.run(1000);
  const double before = servo.output().authority;
  servo.run(1010);
  EXPECT_NEAR(before - servo.output().authority, 10e-3 / servo.settings().guard.fade_time, 1e-9);
}

TEST(SkippedTicks, AfterTooLongAGapTheToolEngagesAsAfterAFault) {
  SimulatedDeviceSettings settings;
  settings.path = path_along_z({{0.2, 0.01}, {0.5, -0.01}, {1.0, -0.01}, {1.2, -0.015}});
  SimulatedDevice device(settings);
  VirtualWall wall = wall_at_zero(500.0);
  ServoTick servo(device, wall, {});
  const double held = run_ticks(servo, 0, 1000).back().force.norm();
  take_events(servo.events());
  servo.run(1025);
  EXPECT_TRUE(take_events(servo.events()).empty()) << "that much a busy machine may take";
  servo.run(1325);
  const auto events = take_events(servo.events());
  ASSERT_TRUE(has_event(events, ServoEventKind::kTicksMissing));
  EXPECT_NEAR(events.front().value, 0.3, 1e-9);
  const auto after = run_ticks(servo, 1326, 2500);
  EXPECT_EQ(after[50].force, Vec3::Zero());
  EXPECT_TRUE(has_event(take_events(servo.events()), ServoEventKind::kEngaged));
  EXPECT_GT(after.back().force.norm(), held);
  for (std::size_t i = 1; i < after.size(); ++i)
    EXPECT_LT(after[i].force.norm() - after[i - 1].force.norm(), 0.1) << i;
}

}  // namespace
}  // namespace viscera::test
