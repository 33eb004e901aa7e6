// The parts that keep a hand safe, each by figures worked out by hand: a mutation run
// (tools/mutate) found that whole servos forgive a limit of twice its size.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "haptics/device_guard.h"
#include "haptics/force_limits.h"
#include "haptics/passivity.h"
#include "haptics/servo_event.h"

namespace viscera {
namespace {

constexpr double kTick = 1e-3;

DeviceLimits round_limits() {
  DeviceLimits limits;
  limits.work_space = Box(Vec3::Constant(-1.0), Vec3::Constant(1.0));
  limits.peak_force = 8.0;
  limits.continuous_force = 2.0;
  limits.resolution = 1e-4;
  limits.apparent_mass = 0.1;
  limits.friction = 0.05;
  limits.stale_after = 0.02;
  return limits;
}

TEST(ForceLimits, RiseByThePeakForceWithinTheRiseTimeAndNoFaster) {
  // 8 N in 5 ms.
  ForceLimits limits({}, round_limits(), kTick);
  EXPECT_NEAR(limits.apply(Vec3(5.0, 0.0, 0.0)).x(), 1.6, 1e-12);
  EXPECT_TRUE(limits.limited());
  EXPECT_NEAR(limits.apply(Vec3(5.0, 0.0, 0.0)).x(), 3.2, 1e-12);
  EXPECT_NEAR(limits.apply(Vec3(5.0, 0.0, 0.0)).x(), 4.8, 1e-12);
  EXPECT_NEAR(limits.apply(Vec3(5.0, 0.0, 0.0)).x(), 5.0, 1e-12);
  EXPECT_FALSE(limits.limited());
  EXPECT_NEAR(limits.apply(Vec3(-5.0, 0.0, 0.0)).x(), 3.4, 1e-12) << "and falls no faster";
}

TEST(ForceLimits, MotorsThatGetHotBearTheContinuousForceInTheEnd) {
  ForceLimits limits({0.005, 0.1}, round_limits(), kTick);
  double greatest = 0.0, last = 0.0;
  for (int tick = 0; tick < 2000; ++tick) {
    last = limits.apply(Vec3(100.0, 0.0, 0.0)).norm();
    greatest = std::max(greatest, last);
  }
  EXPECT_GT(greatest, 6.0) << "cold motors bear nearly the peak";
  EXPECT_NEAR(last, 2.0, 0.01);
  EXPECT_NEAR(limits.state().mean_square, 4.0, 0.05);
}

TEST(ForceLimits, HalfwayHotTheBoundIsHalfwayBetweenPeakAndContinuous) {
  ForceLimits limits({1e-6, 10.0}, round_limits(), kTick);
  ForceLimits::State state;
  state.mean_square = 2.0;  // half of 2 N squared
  limits.restore(state);
  EXPECT_NEAR(limits.apply(Vec3(0.0, 100.0, 0.0)).norm(), 5.0, 1e-9);
  state.mean_square = 400.0;
  limits.restore(state);
  EXPECT_NEAR(limits.apply(Vec3(0.0, 100.0, 0.0)).norm(), 2.0, 1e-9) << "never below";
}

TEST(ForceLimits, TheGateAllowsRoundingAndNoMore) {
  const ForceLimits limits({}, round_limits(), kTick);
  EXPECT_EQ(limits.judge(Vec3(8.0 * (1.0 + 1e-10), 0, 0)), ForceLimits::Verdict::kSound);
  EXPECT_EQ(limits.judge(Vec3(8.0 * (1.0 + 1e-8), 0, 0)), ForceLimits::Verdict::kTooLarge);
}

DeviceState reading(double x, std::uint64_t sample) {
  DeviceState state;
  state.pose.position = Vec3(x, 0.0, 0.0);
  state.sample = sample;
  return state;
}

/// Whether a guard that saw x = 0 at tick 10 believes this at that tick.
bool believed(const DeviceState& state, std::uint64_t tick) {
  DeviceGuard guard({}, round_limits(), kTick);
  ServoEventRing events;
  guard.judge(reading(0.0, 1), 10, kTick, events);
  guard.judge(state, tick, kTick, events);
  return guard.sound();
}

TEST(DeviceGuard, AHandGoesThreeMetresASecondAndTwoStepsOfTheEncoders) {
  // 3 m/s over 4 ms, and 2 x 0.1 mm.
  EXPECT_TRUE(believed(reading(0.0121, 2), 14));
  EXPECT_FALSE(believed(reading(0.0123, 2), 14));
  EXPECT_TRUE(believed(reading(0.0031, 2), 11));
  EXPECT_FALSE(believed(reading(0.0033, 2), 11));
}

TEST(DeviceGuard, AReadingMayStayForTheDevicesTimeAndNoLonger) {
  EXPECT_TRUE(believed(reading(0.0, 1), 29));
  EXPECT_FALSE(believed(reading(0.0, 1), 31));
}

TEST(DeviceGuard, AFaultIsToldOnceAndAnotherKindAgain) {
  DeviceGuard guard({}, round_limits(), kTick);
  ServoEventRing events;
  ServoEvent event;
  const auto told = [&] {
    int count = 0;
    while (events.pop(event)) ++count;
    return count;
  };
  guard.fault(ServoEventKind::kForceTooLarge, 1, events, 9.0);
  EXPECT_EQ(told(), 1);
  guard.fault(ServoEventKind::kForceTooLarge, 2, events, 9.0);
  EXPECT_EQ(told(), 0);
  guard.fault(ServoEventKind::kTicksMissing, 3, events, 0.05);
  EXPECT_EQ(told(), 1);
}

/// What a step costs the budget.
PassivityGuard::Step step(double x, double stored, bool full = true) {
  PassivityGuard::Step one;
  one.device = Vec3(x, 0.0, 0.0);
  one.stored = stored;
  one.dt = kTick;
  one.full = full;
  return one;
}

TEST(PassivityGuard, BooksTheWorkOfTheHeldForceAgainstWhatIsStored) {
  PassivityGuard guard({}, round_limits(), kTick);
  guard.reset(Vec3::Zero());
  guard.update(Vec3::Zero(), step(0.0, 1e-3));
  // The hand gives 2 N x 1 mm, and 1.5 mJ more is stored; 0.5 mJ went, of which the tolerance of
  // ten encoder steps under the continuous force, 2 mJ, would be kept.
  guard.update(Vec3(-2.0, 0.0, 0.0), step(1e-3, 2.5e-3));
  EXPECT_NEAR(guard.state().budget, 0.5e-3, 1e-12);
  EXPECT_NEAR(guard.given(), -2e-3, 1e-12);
  // It gets 3 mJ back for the 1 mJ that the tissue loses.
  const Vec3 damping = guard.update(Vec3(3.0, 0.0, 0.0), step(2e-3, 1.5e-3));
  EXPECT_NEAR(guard.state().budget, -1.5e-3, 1e-12);
  EXPECT_LT(damping.x(), 0.0);
  EXPECT_EQ(guard.violations(), 0u) << "within the tolerance";
  guard.update(Vec3(2.0, 0.0, 0.0), step(3e-3, 1.5e-3));
  EXPECT_EQ(guard.violations(), 1u);
}

TEST(PassivityGuard, WhatWasStoredStaysTheHandsWhenNobodyKnowsItAnyMore) {
  PassivityGuard guard({}, round_limits(), kTick);
  guard.reset(Vec3::Zero());
  guard.update(Vec3::Zero(), step(0.0, 0.0));
  guard.update(Vec3(-2.0, 0.0, 0.0), step(1e-3, 2e-3));  // 2 mJ given, and stored
  guard.update(Vec3::Zero(), step(1e-3, -1.0));
  guard.update(Vec3(2.0, 0.0, 0.0), step(2e-3, -1.0));  // given back
  EXPECT_GE(guard.state().budget, -1e-12);
  EXPECT_EQ(guard.violations(), 0u);
}

TEST(PassivityGuard, NoMoreThanTheToleranceIsKeptForLater) {
  PassivityGuard guard({}, round_limits(), kTick);
  guard.reset(Vec3::Zero());
  guard.update(Vec3::Zero(), step(0.0, 0.0));
  guard.update(Vec3(-2.0, 0.0, 0.0), step(10e-3, 0.0));  // 20 mJ taken from the hand
  EXPECT_NEAR(guard.state().budget, 10.0 * 2.0 * 1e-4, 1e-12);
}

TEST(PassivityGuard, TheDevicesFrictionPaysWithinOneStepOfTheEncodersAlone) {
  for (const bool full : {true, false}) {
    PassivityGuard guard({}, round_limits(), kTick);
    guard.reset(Vec3::Zero());
    guard.update(Vec3::Zero(), step(0.0, 0.0));
    guard.update(Vec3::Zero(), step(0.9e-4, 0.0, full));
    EXPECT_NEAR(guard.state().budget, full ? 0.05 * 0.9e-4 : 0.0, 1e-15);
  }
  // A step is 0.1 mm, and more than one along an axis up to 0.12 mm.
  for (const double moved : {1.15e-4, 1.25e-4, 5e-4}) {
    PassivityGuard guard({}, round_limits(), kTick);
    guard.reset(Vec3::Zero());
    guard.update(Vec3::Zero(), step(0.0, 0.0));
    guard.update(Vec3::Zero(), step(moved, 0.0));
    EXPECT_NEAR(guard.state().budget, moved < 1.2e-4 ? 0.05 * moved : 0.0, 1e-15);
  }
}

TEST(PassivityGuard, ATickWhoseForceIsHeldBackEarnsNothing) {
  PassivityGuard guard({}, round_limits(), kTick);
  guard.reset(Vec3::Zero());
  guard.update(Vec3::Zero(), step(0.0, 0.0));
  guard.update(Vec3(-2.0, 0.0, 0.0), step(0.5e-3, 0.0));  // the hand gives a millijoule
  EXPECT_NEAR(guard.state().budget, 1e-3, 1e-12);
  guard.update(Vec3(-1.0, 0.0, 0.0), step(1.0e-3, 0.0, false));
  EXPECT_NEAR(guard.state().budget, 1e-3, 1e-12) << "half a millijoule more isn't booked";
  guard.update(Vec3(3.0, 0.0, 0.0), step(1.5e-3, 0.0, false));
  EXPECT_NEAR(guard.state().budget, -0.5e-3, 1e-12) << "what is given is";
  guard.update(Vec3(-3.0, 0.0, 0.0), step(2.0e-3, 0.0, false));
  EXPECT_NEAR(guard.state().budget, 0.0, 1e-12) << "and debts are paid";
}

TEST(PassivityGuard, AForceThatFadesOutGivesBackWhatWasStoredAndOwesTheRest) {
  PassivityGuard guard({}, round_limits(), kTick);
  guard.reset(Vec3::Zero());
  guard.update(Vec3::Zero(), step(0.0, 3e-3));
  const auto fade_to = [&](double x) { guard.fade(Vec3(2.0, 0.0, 0.0), Vec3(x, 0.0, 0.0), kTick); };
  fade_to(1e-3);  // 2 of the 3 mJ
  EXPECT_NEAR(guard.state().budget, 0.0, 1e-12);
  EXPECT_NEAR(guard.state().stored, 1e-3, 1e-12);
  fade_to(2e-3);  // and 2 mJ more
  EXPECT_NEAR(guard.state().budget, -1e-3, 1e-12);
  EXPECT_NEAR(guard.state().stored, 0.0, 1e-12);
  // The hand gives 10 mJ, of which the tolerance is kept.
  fade_to(-3e-3);
  EXPECT_NEAR(guard.state().budget, 2e-3, 1e-12);
}

TEST(PassivityGuard, WhatTheSceneSuppliesMayReachTheHandByTheShareThatIsShown) {
  PassivityGuard guard({}, round_limits(), kTick);
  guard.reset(Vec3::Zero());
  guard.update(Vec3::Zero(), step(0.0, 1e-3));
  guard.show(0.5);
  PassivityGuard::Step one = step(1e-3, 1.5e-3);
  one.supplied = 2e-3;
  guard.update(Vec3(1.0, 0.0, 0.0), one);
  // Half of 2 mJ came, half of 0.5 mJ was stored, 1 mJ went to the hand.
  EXPECT_NEAR(guard.state().budget, 1e-3 - 0.25e-3 - 1e-3, 1e-12);
}

TEST(PassivityGuard, TheDamperTakesWhatIsMissingWithinATickUpToItsGreatest) {
  const double velocity = 1.0 - std::exp(-2.0 * std::numbers::pi * 50.0 * kTick);  // of 1 m/s
  // With nothing stored: the force's work over a millimetre is missing.
  const auto damping = [&](double force) {
    PassivityGuard guard({}, round_limits(), kTick);
    guard.reset(Vec3::Zero());
    guard.update(Vec3::Zero(), step(0.0, 0.0));
    guard.update(Vec3(force, 0.0, 0.0), step(1e-3, 0.0));
    EXPECT_NEAR(guard.state().velocity.x(), velocity, 1e-12);
    return guard.damping();
  };
  // 0.1 of 0.1 kg x 2 pi 50 Hz.
  const double greatest = 0.1 * 0.1 * 2.0 * std::numbers::pi * 50.0;
  EXPECT_NEAR(damping(1.0), greatest, 1e-9);
  EXPECT_NEAR(damping(0.1), 0.1e-3 / (kTick * velocity * velocity), 1e-9);
}

TEST(ServoEvents, SayTheirFiguresInMillimetresAndMilliseconds) {
  const auto says = [](ServoEventKind kind, double value, const char* words) {
    const std::string text = describe({1, kind, value});
    EXPECT_NE(text.find(words), std::string::npos) << text;
  };
  says(ServoEventKind::kDeviceOutside, 0.0215, " 21.5 mm ");
  says(ServoEventKind::kDeviceJumped, 0.0123, " 12.3 mm");
  says(ServoEventKind::kDeviceFrozen, 0.025, " 25 ms");
  says(ServoEventKind::kTicksMissing, 0.035, " 35 ms");
  says(ServoEventKind::kForceTooLarge, 9.25, " 9.2 N");
}

}  // namespace
}  // namespace viscera
