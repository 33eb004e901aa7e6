#include "engine/features/parting/blade_feel.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace viscera::test {
namespace {

constexpr double kTick = 1e-3;
const Vec3 kAhead = Vec3::UnitX();

/// An edge along z, in tissue that withstands so much ahead of it and so much behind [N].
BladeAsFelt edge_in_tissue(double ahead, double behind) {
  BladeAsFelt felt;
  for (std::size_t k = 0; k < BladeAsFelt::kWays; ++k)
    felt.holds[k] = felt.way(k).dot(kAhead) > -0.1 ? ahead : behind;
  return felt;
}

void tell(BladeFeel& blade, const BladeAsFelt& felt) {
  blade.frames().back() = felt;
  blade.frames().publish();
}

/// After so many ticks along a straight way; the edge has been at rest at its beginning.
TactileForce after_way(BladeFeel& blade, const Vec3& from, const Vec3& to, int ticks = 200) {
  TactileForce felt;
  for (int tick = 1; tick <= ticks; ++tick)
    felt = blade.respond(from + (to - from) * tick / ticks, kTick);
  return felt;
}

TEST(BladeFeel, FeelsNothingBeforeAFrameSaysSo) {
  BladeFeel blade;
  const TactileForce felt = after_way(blade, Vec3::Zero(), 5e-3 * kAhead);
  EXPECT_EQ(felt.force, Vec3::Zero());
  EXPECT_FALSE(felt.touching);
  EXPECT_EQ(felt.energy, 0.0);
}

TEST(BladeFeel, TissueAheadHoldsTheEdgeUntilItPartsAndNoHarder) {
  BladeFeel blade;
  tell(blade, edge_in_tissue(0.6, 0.0));
  after_way(blade, Vec3::Zero(), Vec3::Zero());
  const TactileForce touched = after_way(blade, Vec3::Zero(), 0.2e-3 * kAhead);
  EXPECT_LT(touched.force.dot(kAhead), -0.2);
  EXPECT_GT(touched.force.dot(kAhead), -0.5);
  const TactileForce cutting = after_way(blade, 0.2e-3 * kAhead, 5e-3 * kAhead);
  EXPECT_NEAR(cutting.force.dot(kAhead), -0.6, 0.01);
  EXPECT_NEAR((cutting.force - cutting.force.dot(kAhead) * kAhead).norm(), 0.0, 1e-9);
  EXPECT_NEAR(kAhead.dot(cutting.stiffness * kAhead), 0.0, 1e-6) << "no harder farther on";
}

TEST(BladeFeel, NothingHoldsItAlongItsEdgeOrBackInItsKerf) {
  BladeFeel blade;
  tell(blade, edge_in_tissue(0.6, 0.0));
  after_way(blade, Vec3::Zero(), 5e-3 * kAhead);
  EXPECT_LT(after_way(blade, 5e-3 * kAhead, 3e-3 * kAhead).force.norm(), 0.01);
  EXPECT_LT(after_way(blade, 3e-3 * kAhead, 3e-3 * kAhead + 4e-3 * Vec3::UnitZ()).force.norm(),
            0.01);
}

TEST(BladeFeel, AClosedWayTakesWorkAndNeverGives) {
  BladeFeel blade;
  tell(blade, edge_in_tissue(0.6, 0.3));
  after_way(blade, Vec3::Zero(), Vec3::Zero());
  constexpr int kTicks = 2000;
  double work = 0.0, least = 0.0;  // of the force on the hand
  Vec3 before = Vec3::Zero(), held = Vec3::Zero();
  for (int tick = 1; tick <= kTicks; ++tick) {
    const double angle = 8.0 * std::numbers::pi * tick / kTicks;
    const Vec3 tip(2e-3 * std::sin(angle), 1e-3 * std::sin(2.0 * angle), 0.0);
    work += held.dot(tip - before);
    const TactileForce felt = blade.respond(tip, kTick);
    least = std::min(least, work + felt.energy);
    held = felt.force;
    before = tip;
  }
  EXPECT_LT(work, -0.3 * 8e-3);
  EXPECT_LE(least, 0.0);
}

TEST(BladeFeel, MovingTissueTakesItsEdgeAlongAndPaysForIt) {
  BladeAsFelt felt = edge_in_tissue(0.6, 0.6);
  felt.velocity = 20e-3 * kAhead;
  BladeFeel follows, stays;
  tell(follows, felt);
  tell(stays, felt);
  after_way(follows, Vec3::Zero(), 4e-3 * kAhead);  // as fast as the tissue
  EXPECT_LT(follows.respond(4.02e-3 * kAhead, kTick).force.norm(), 0.04);
  after_way(stays, Vec3::Zero(), Vec3::Zero());
  const TactileForce held = stays.respond(Vec3::Zero(), kTick);
  EXPECT_NEAR(held.force.dot(kAhead), 0.6, 0.01);
  EXPECT_NEAR(held.supplied, 0.6 * 20e-3 * kTick, 0.01 * 0.6 * 20e-3 * kTick);
}

TEST(BladeFeel, ABladeThatTurnsIsHeldByTheSameTissue) {
  BladeFeel blade;
  BladeAsFelt felt = edge_in_tissue(0.6, 0.0);
  tell(blade, felt);
  after_way(blade, Vec3::Zero(), 5e-3 * kAhead);
  // Its edge leans past the diagonal between two axes.
  felt.along = Vec3(0.02, -0.021, 1.0).normalized();
  tell(blade, felt);
  EXPECT_NEAR(blade.respond(5.05e-3 * kAhead, kTick).force.norm(), 0.6, 0.02);
}

TEST(BladeFeel, WhatAFrameFindsOtherwiseIsEasedIn) {
  BladeFeel blade;
  tell(blade, edge_in_tissue(0.2, 0.2));
  after_way(blade, Vec3::Zero(), 5e-3 * kAhead);
  tell(blade, edge_in_tissue(0.0, 0.0));
  double last = 0.2;
  for (int tick = 0; tick < 100; ++tick) {
    const double now = blade.respond(5e-3 * kAhead, kTick).force.norm();
    EXPECT_LE(now, last + 1e-12);
    EXPECT_GT(now, last - 0.02);
    last = now;
  }
  EXPECT_LT(last, 1e-3);
}

TEST(BladeFeel, GoesOnFromItsStateAndRefusesOneThatIsNone) {
  BladeFeel blade;
  tell(blade, edge_in_tissue(0.6, 0.0));
  after_way(blade, Vec3::Zero(), 2e-3 * kAhead);
  BladeFeel other;
  other.restore(blade.state());
  EXPECT_EQ(other.respond(2.1e-3 * kAhead, kTick).force,
            blade.respond(2.1e-3 * kAhead, kTick).force);
  BladeFeel::State state = blade.state();
  EXPECT_TRUE(BladeFeel::fits(state));
  state.holds[3] = -1.0;
  EXPECT_FALSE(BladeFeel::fits(state));
}

}  // namespace
}  // namespace viscera::test
