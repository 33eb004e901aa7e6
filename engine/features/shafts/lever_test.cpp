#include "engine/features/shafts/lever.h"

#include <gtest/gtest.h>

namespace viscera::test {
namespace {

const Vec3 kHandsTrocar(0.1, -0.05, 0.2), kHandsTip(-0.03, 0.02, 0.04);

ShaftLoad some_load() {
  ShaftLoad load;
  const Vec3 along = (kHandsTip - kHandsTrocar).normalized();
  load.add(Vec3(0.3, -1.2, 0.8), kHandsTrocar + 0.11 * along, kHandsTrocar);
  load.add(Vec3(-0.1, 0.4, 2.0), kHandsTrocar + 0.16 * along + Vec3(1e-3, 2e-3, 0), kHandsTrocar);
  return load;
}

TEST(Lever, TissueTrocarAndHandHoldTheShaftInBalance) {
  const ShaftLoad load = some_load();
  const LeverForces forces = about_trocar(load, kHandsTip, kHandsTrocar);
  const Vec3 hand = -forces.at_tip;
  EXPECT_LT((load.force + forces.reaction + hand).norm(), 1e-9);
  // About the trocar, where its reaction has no moment: all but the twist, which the grip holds.
  const Vec3 arm = kHandsTip - kHandsTrocar;
  const Vec3 left = load.torque + arm.cross(hand);
  EXPECT_LT((left - forces.twist * arm.normalized()).norm(), 1e-9);
  // And about the tip.
  const Vec3 about_tip =
      load.torque + (kHandsTrocar - kHandsTip).cross(load.force + forces.reaction);
  EXPECT_LT((about_tip - forces.twist * arm.normalized()).norm(), 1e-9);
}

TEST(Lever, HalfWayToTheTipHalfOfAForceReachesTheHandAndTheTrocarTakesTheRest) {
  ShaftLoad load;
  load.add(Vec3(0, 0, 2.0), Vec3(0.1, 0, 0), Vec3::Zero());
  const LeverForces forces = about_trocar(load, Vec3(0.2, 0, 0), Vec3::Zero());
  EXPECT_LT((forces.at_tip - Vec3(0, 0, 1.0)).norm(), 1e-12);
  EXPECT_LT((forces.reaction - Vec3(0, 0, -1.0)).norm(), 1e-12);
  EXPECT_DOUBLE_EQ(lever_share(Vec3(0.1, 0, 0), Vec3(0.2, 0, 0), Vec3::Zero()), 0.5);
}

TEST(Lever, WhatActsAlongTheShaftReachesTheHandWhole) {
  ShaftLoad load;
  load.add(Vec3(0.7, 0, 0), Vec3(0.05, 0, 0), Vec3::Zero());
  const LeverForces forces = about_trocar(load, Vec3(0.2, 0, 0), Vec3::Zero());
  EXPECT_LT((forces.at_tip - Vec3(0.7, 0, 0)).norm(), 1e-12);
  EXPECT_LT(forces.reaction.norm(), 1e-12);
}

TEST(Lever, ATipInItsTrocarFeelsNothingOfIt) {
  const LeverForces forces = about_trocar(some_load(), kHandsTrocar, kHandsTrocar);
  EXPECT_EQ(forces.at_tip, Vec3::Zero());
  EXPECT_EQ(forces.reaction, Vec3(-some_load().force));
}

}  // namespace
}  // namespace viscera::test
