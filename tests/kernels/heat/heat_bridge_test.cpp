// Heat between two organs.
#include "kernels/heat/heat_bridge.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/kernels/heat/heated_liver.h"

namespace viscera {
namespace {

constexpr double kStep = 1.0 / 60.0;
constexpr double kSide = 8 * 0.5e-3;  // of a brick [m]

/// One brick of tissue, which loses nothing to anybody.
SignedDistance one_brick() {
  return [](const Vec3& p) {
    return (p - Vec3::Constant(0.5 * kSide)).cwiseAbs().maxCoeff() - 0.5 * kSide;
  };
}
BioheatOptions closed() {
  BioheatOptions options;
  options.cooling.coefficient = 0.0;
  options.cooling.evaporates = false;
  return options;
}
ThermalTissue bloodless() {
  ThermalTissue tissue;
  tissue.perfusion = 0.0;
  tissue.metabolic_heat = 0.0;
  return tissue;
}

double mean_excess(const Bioheat& heat) {
  double sum = 0.0;
  for (const float excess : heat.bricks().brick(0).warm->excess) sum += excess;
  return sum / BrickField::kVoxels;
}

TEST(HeatBridge, TwoBricksComeToTheSameWarmthAsTwoCapacitiesDo) {
  // Over one side of each, slowly beside what spreads within them: between their means lies a third
  // of either side's length, too.
  Bioheat warm(bloodless(), closed(), one_brick()), cold(bloodless(), closed(), one_brick());
  set_excess(warm, Box(Vec3::Zero(), Vec3::Constant(kSide)), [](const Vec3&) { return 20.0; });
  warm.begin_book();
  cold.begin_book();
  const double voxel = warm.options().voxel, each = 2e-6;  // [W/K]
  double capacity = 0.0;
  for (int v = 0; v < BrickField::kVoxels; ++v)
    capacity += warm.voxel_capacity(warm.bricks().brick(0), v);
  constexpr double kLong = 0.25;  // a step [s]
  double gone = 0.0, time = 0.0;
  for (; time < 900.0; time += kLong) {
    for (int y = 0; y < 8; ++y)
      for (int x = 0; x < 8; ++x) {
        const Vec3 at((x + 0.5) * voxel, (y + 0.5) * voxel, 0.5 * voxel);
        gone += conduct(warm, at, cold, at, each, kLong);
      }
    warm.step(kLong);
    cold.step(kLong);
  }
  const double resistance =
      1.0 / (64.0 * each) + 2.0 / (3.0 * warm.tissue().conductivity * kSide);  // [K/W]
  const double exact = 20.0 * std::exp(-2.0 * time / (capacity * resistance));
  EXPECT_NEAR(mean_excess(warm) - mean_excess(cold), exact, 0.02 * 20.0);
  EXPECT_NEAR(mean_excess(warm) + mean_excess(cold), 20.0, 2e-3);
  // What one got the other gave.
  EXPECT_NEAR(cold.book().delivered, gone, 1e-4 * gone);
  EXPECT_NEAR(warm.book().delivered, -gone, 1e-4 * gone);
  EXPECT_NEAR(cold.book().residual(), 0.0, 1e-3 * gone);
  EXPECT_NEAR(warm.book().residual(), 0.0, 1e-3 * gone);
}

TEST(HeatBridge, NoConductanceMakesItSwing) {
  Bioheat warm(bloodless(), closed(), one_brick()), cold(bloodless(), closed(), one_brick());
  set_excess(warm, Box(Vec3::Zero(), Vec3::Constant(kSide)), [](const Vec3&) { return 20.0; });
  const Vec3 at = Vec3::Constant(0.25e-3);
  for (int step = 0; step < 20; ++step) {
    conduct(warm, at, cold, at, 1e6, kStep);
    warm.step(kStep);
    cold.step(kStep);
    EXPECT_GE(warm.bricks().excess_at({0, 0, 0}), cold.bricks().excess_at({0, 0, 0}));
  }
  EXPECT_GT(cold.bricks().excess_at({0, 0, 0}), 1.0);
}

TEST(HeatBridge, WhatIsAsColdOrNoTissueAtAllWarmsNothingUp) {
  Bioheat one(bloodless(), closed(), one_brick()), other(bloodless(), closed(), one_brick());
  const Vec3 inside = Vec3::Constant(0.5 * kSide), outside = Vec3::Constant(5.0 * kSide);
  EXPECT_EQ(conduct(one, inside, other, inside, 1e-3, kStep), 0.0);
  EXPECT_EQ(one.warm_bricks() + other.warm_bricks(), 0u);
  EXPECT_EQ(one.bricks().count() + other.bricks().count(), 0u);
  set_excess(one, Box(Vec3::Zero(), Vec3::Constant(kSide)), [](const Vec3&) { return 20.0; });
  EXPECT_EQ(conduct(one, inside, other, outside, 1e-3, kStep), 0.0);
  EXPECT_EQ(other.bricks().count(), 0u);
}

}  // namespace
}  // namespace viscera
