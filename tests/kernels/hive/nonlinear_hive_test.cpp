#include "kernels/hive/nonlinear_hive.h"

#include <gtest/gtest.h>

#include <cmath>

#include "engine/verification/ball_and_hive.h"
#include "engine/verification/pressed_block.h"

namespace viscera {
namespace {

constexpr double kBall = 5e-3;  // [m]
const IsotropicMaterial kTissue{5e3, 0.45};

// A ball above flat, deep tissue.
struct Pressed : BallAndHive {
  Pressed(HyperelasticModel model, int rings, int nodes)
      : BallAndHive({model, kTissue, rings, nodes}, kBall) {}
  NonlinearForce at(double depth, TimeIsUp time = {}) { return press(depth, time); }
  // In as a hand goes in, 25 mm/s.
  NonlinearForce go(double from, double to) { return BallAndHive::go(from, to, 2.5e-5); }
};

TEST(NonlinearHive, AShallowTouchIsTheLinearHives) {
  for (const HyperelasticModel model : {HyperelasticModel::kNeoHookean, HyperelasticModel::kStvk}) {
    Pressed tool(model, 3, 80);
    const double depth = 1e-5 * kBall;
    const NonlinearForce force = tool.at(depth);
    EXPECT_EQ(force.hive.verdict, HiveVerdict::kSound);
    EXPECT_NEAR(force.hive.force.z(), tool.linear(depth), 1e-3 * tool.linear(depth));
    EXPECT_NEAR(force.hive.energy, 0.5 * depth * force.hive.force.z(), 1e-3 * force.hive.energy);
  }
}

TEST(NonlinearHive, WithManyCellsItIsTheWholeBodysConvergedAnswer) {
  PressedBlockOptions options;
  options.material = kTissue;
  options.ball_radius = kBall;
  options.depths = {0.1 * kBall, 0.3 * kBall};
  options.elements = 8;
  const std::vector<double> exact = press_block(options);
  ASSERT_EQ(exact.size(), 2u);
  Pressed many(HyperelasticModel::kNeoHookean, 6, 200),
      usual(HyperelasticModel::kNeoHookean, 3, 80);
  for (std::size_t i = 0; i < exact.size(); ++i) {
    EXPECT_NEAR(many.go(0.0, options.depths[i]).hive.force.z(), exact[i], 0.01 * exact[i]) << i;
    EXPECT_NEAR(usual.go(0.0, options.depths[i]).hive.force.z(), exact[i], 0.03 * exact[i]) << i;
  }
}

TEST(NonlinearHive, MoreNodesChangeItsForceLess) {
  for (const double depth : {0.2 * kBall, 0.6 * kBall}) {
    const auto force = [&](int nodes) {
      Pressed tool(HyperelasticModel::kNeoHookean, 3, nodes);
      return tool.go(0.0, depth).hive.force.z();
    };
    const double fine = force(800);
    EXPECT_NEAR(force(28), fine, 0.03 * fine) << depth;
    EXPECT_NEAR(force(80), fine, 0.015 * fine) << depth;
  }
}

TEST(NonlinearHive, ATickOfAMovingHandIsAFewStepsAndSettles) {
  Pressed tool(HyperelasticModel::kNeoHookean, 3, 80);
  tool.go(0.0, 1e-4);
  int steps = 0, unsettled = 0, ticks = 0;
  double last = tool.at(1e-4).hive.force.z();
  for (double depth = 1e-4; depth < 0.9 * kBall; depth += 1e-4, ++ticks) {  // 0.1 m/s
    const NonlinearForce force = tool.at(depth);
    steps += force.steps;
    unsettled += force.by_tangent;
    EXPECT_GE(force.hive.force.z(), 0.9999 * last);
    last = force.hive.force.z();
  }
  EXPECT_EQ(unsettled, 0);
  EXPECT_LE(steps, 2 * ticks + 5);
}

TEST(NonlinearHive, ItsStiffnessIsTheSlopeOfItsForce) {
  Pressed tool(HyperelasticModel::kNeoHookean, 3, 80);
  const NonlinearForce force = tool.go(0.0, 0.33 * kBall);
  // The pattern grows with depth; its slope is that of cells that stay.
  NonlinearHive::Share share{&tool.hive(), 1.0};
  const double step = 1e-4 * kBall;
  for (double& depth : tool.depths()) depth += step;
  const NonlinearForce deeper =
      tool.nonlinear().press({&share, 1}, tool.depths(), tool.across(), kBall);
  const double slope = (deeper.hive.force.z() - force.hive.force.z()) / step;
  EXPECT_NEAR(force.stiffness, slope, 0.02 * slope);
  // What went in is stored.
  EXPECT_NEAR(deeper.hive.energy - force.hive.energy,
              0.5 * step * (deeper.hive.force.z() + force.hive.force.z()),
              0.02 * (deeper.hive.energy - force.hive.energy));
}

TEST(NonlinearHive, AClosedPathReturnsWhatWentIn) {
  Pressed tool(HyperelasticModel::kNeoHookean, 3, 80);
  double work = 0.0, last = 0.0, at = 0.0, stored = 0.0;
  constexpr int kTicks = 400;
  for (int i = 1; i <= 2 * kTicks; ++i) {
    const double depth = 0.8 * kBall * (i <= kTicks ? i : 2 * kTicks - i) / kTicks;
    const NonlinearForce force = tool.at(std::max(depth, 1e-9));
    work += 0.5 * (force.hive.force.z() + last) * (depth - at);
    stored = std::max(stored, force.hive.energy);
    last = force.hive.force.z();
    at = depth;
  }
  EXPECT_NEAR(work, 0.0, 2e-3 * stored);
}

TEST(NonlinearHive, NoTimeMeansTheLastGoodTangentsAnswer) {
  Pressed tool(HyperelasticModel::kNeoHookean, 3, 80);
  const double depth = 0.4 * kBall;
  tool.go(0.0, depth);
  const TimeIsUp now{[](void*) { return true; }, nullptr};
  const NonlinearForce hurried = tool.at(depth + 5e-5, now);
  EXPECT_EQ(hurried.steps, 0);
  EXPECT_TRUE(hurried.by_tangent);
  EXPECT_EQ(hurried.hive.verdict, HiveVerdict::kSound);
  const NonlinearForce calm = tool.at(depth + 5e-5);
  EXPECT_GT(calm.steps, 0);
  EXPECT_FALSE(calm.by_tangent);
  EXPECT_NEAR(hurried.hive.force.z(), calm.hive.force.z(), 1e-3 * calm.hive.force.z());
  // After a few steps more time is up: these count.
  int asked = 0;
  const TimeIsUp soon{[](void* user) { return ++*static_cast<int*>(user) > 1; }, &asked};
  const NonlinearForce jumped = tool.at(1.2 * depth, soon);
  EXPECT_EQ(jumped.steps, 1);
  EXPECT_TRUE(jumped.by_tangent);
}

TEST(NonlinearHive, NeoHookeanTissueSoftensLessThanStVenantKirchhoff) {
  Pressed neo(HyperelasticModel::kNeoHookean, 3, 80), stvk(HyperelasticModel::kStvk, 3, 80);
  const double depth = 0.08 * kBall;
  const double linear = neo.linear(depth);
  const double by_neo = neo.go(0.0, depth).hive.force.z(),
               by_stvk = stvk.go(0.0, depth).hive.force.z();
  EXPECT_LT(by_neo, linear);
  EXPECT_GT(by_neo, 0.95 * linear);
  EXPECT_LT(by_stvk, 0.9 * linear);
}

TEST(NonlinearHive, WhereTissueGivesWayTheForceGoesOnAlongItsLastTangentAndComesBack) {
  Pressed tool(HyperelasticModel::kStvk, 3, 80);
  int by_tangent = 0;
  double last = 0.0, worst = 0.0, stiffest = 0.0;
  for (int i = 1; i <= 400; ++i) {
    const double depth = 0.8 * kBall * (i <= 200 ? i : 400 - i) / 200.0;
    const NonlinearForce force = tool.at(std::max(depth, 1e-9));
    ASSERT_EQ(force.hive.verdict, HiveVerdict::kSound) << i;
    by_tangent += force.by_tangent;
    stiffest = std::max(stiffest, force.stiffness);
    worst = std::max(worst, std::abs(force.hive.force.z() - last));
    last = force.hive.force.z();
  }
  EXPECT_GT(by_tangent, 0);
  EXPECT_LT(worst, 2.0 * stiffest * 0.8 * kBall / 200.0);
  // As far back as it was sound it is again.
  Pressed fresh(HyperelasticModel::kStvk, 3, 80);
  const double depth = 0.05 * kBall;
  EXPECT_NEAR(tool.go(0.0, depth).hive.force.z(), fresh.go(0.0, depth).hive.force.z(),
              0.02 * fresh.at(depth).hive.force.z());
}

TEST(NonlinearHive, TwoHivesSpeakAsTheirShares) {
  Pressed tool(HyperelasticModel::kNeoHookean, 3, 80);
  const double whole = tool.go(0.0, 0.3 * kBall).hive.force.z();
  Hive other = tool.another();
  const std::array<NonlinearHive::Share, 2> shares{{{&tool.hive(), 0.25}, {&other, 0.75}}};
  EXPECT_NEAR(tool.nonlinear().press(shares, tool.depths(), tool.across(), kBall).hive.force.z(),
              whole, 1e-4 * whole);
  const NonlinearHive::Share half{&tool.hive(), 0.5};
  EXPECT_NEAR(
      tool.nonlinear().press({&half, 1}, tool.depths(), tool.across(), kBall).hive.force.z(),
      0.5 * whole, 1e-4 * whole);
}

TEST(NonlinearHive, BadSettingsAndNumbersAreRefused) {
  NonlinearSettings settings;
  settings.material = kTissue;
  settings.model = HyperelasticModel::kLinear;
  settings.rings = 9;
  settings.nodes = 3;
  const auto refused = NonlinearHive::create(settings);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().messages.size(), 3u);
  Pressed tool(HyperelasticModel::kNeoHookean, 3, 80);
  tool.go(0.0, 0.1 * kBall);
  const NonlinearHive::Share share{&tool.hive(), 1.0};
  std::vector<double> broken = tool.depths();
  broken[3] = std::nan("");
  EXPECT_EQ(tool.nonlinear().press({&share, 1}, broken, tool.across(), kBall).hive.verdict,
            HiveVerdict::kNotFinite);
  broken.pop_back();
  EXPECT_EQ(tool.nonlinear().press({&share, 1}, broken, tool.across(), kBall).hive.verdict,
            HiveVerdict::kTooMany);
}

}  // namespace
}  // namespace viscera
