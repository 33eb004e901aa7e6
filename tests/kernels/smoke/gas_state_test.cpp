#include <gtest/gtest.h>

#include <functional>
#include <limits>
#include <vector>

#include "kernels/base/archive.h"
#include "kernels/base/random.h"
#include "kernels/smoke/gas_grid.h"

namespace viscera {
namespace {

constexpr double kFrame = 1.0 / 60.0;
constexpr int kFrames = 60;

GasParameters cavity(int cells = 20) {
  GasParameters parameters;
  parameters.domain = Box(Vec3(-0.1, -0.1, 0.3), Vec3(0.1, 0.1, 0.45));
  parameters.cells = cells;
  parameters.open = {false, true, false, false, false, false};
  return parameters;
}

/// An organ that goes up and down at `speed` [m/s], by whole stretches of frames.
void move_organ(GasGrid& gas, int frame, double speed) {
  const auto& n = gas.cells();
  const double top = 0.33 + 0.01 * std::sin(0.5 * (frame / 4));
  std::vector<std::uint8_t> solid;
  std::vector<Vec3f> velocities;
  for (int k = 0; k < n[2]; ++k)
    for (int j = 0; j < n[1]; ++j)
      for (int i = 0; i < n[0]; ++i) {
        const Vec3 at = gas.cell_middle(i, j, k);
        solid.push_back(at.z() < top || (at - Vec3(0.03, 0.0, 0.38)).norm() < 0.02);
        velocities.push_back(Vec3f(0.0f, 0.0f, static_cast<float>(speed)));
      }
  gas.set_solids(solid, velocities);
}

/// What comes in, is drawn off, leaks and is pushed in a frame follows from its number.
void step(GasGrid& gas, int frame) {
  const bool quiet = frame / 10 % 3 == 2;
  if (frame % 4 == 0) move_organ(gas, frame, quiet ? 0.0 : 0.02 * std::cos(frame));
  const GasInlet in = {.position = Vec3(-0.06, 0.02, 0.42),
                       .direction = Vec3(1.0, 0.0, -0.5),
                       .flow = quiet ? 0.0 : 8e-5};
  const GasEvacuator out = {.position = Vec3(0.06, 0.03, 0.4), .flow = frame % 7 < 3 ? 5e-5 : 0.0};
  gas.set_inlets({&in, 1});
  gas.set_evacuators({&out, 1});
  const GasLeak leak = {.position = Vec3(0.0, -0.08, 0.42),
                        .flow = quiet ? 0.0 : (frame < 30 ? 2e-5 : -1e-5)};
  gas.set_leaks({&leak, 1});
  gas.step(frame % 2 == 0 ? kFrame : 0.5 * kFrame);
}

void push(GasGrid& gas, int frame) {
  std::vector<Vec3f> places, impulses;
  for (std::uint64_t i = 0; i < 50; ++i) {
    const Random random(static_cast<std::uint64_t>(frame), i);
    places.push_back(Vec3(0.05 * random.direction(0) + Vec3(0.0, 0.0, 0.38)).cast<float>());
    impulses.push_back((1e-9 * random.direction(1)).cast<float>());
  }
  gas.place({.places = StridedVectors<const float>(std::span<const Vec3f>(places))});
  gas.add_momentum(StridedVectors<const float>(std::span<const Vec3f>(impulses)));
  if (frame % 30 < 20)
    gas.give({.position = Vec3(-0.03, 0.0, 0.4),
              .impulse = 1e-8,
              .gift = GasGift::steam(GasMixture(), 1e-7, 390.0)});
}

/// Saved between a frame's impulses and its step.
const std::vector<std::vector<std::byte>>& one_life() {
  static const std::vector<std::vector<std::byte>> moments = [] {
    std::vector<std::vector<std::byte>> made;
    GasGrid gas(cavity());
    for (int frame = 0; frame < kFrames; ++frame) {
      if (frame > 0) step(gas, frame - 1);
      push(gas, frame);
      made.push_back(saved(gas));
    }
    return made;
  }();
  return moments;
}

GasGrid::State state_at(int frame) {
  GasGrid::State state;
  ByteReader reader(one_life()[static_cast<std::size_t>(frame)]);
  read(reader, state);
  EXPECT_FALSE(reader.failed());
  EXPECT_TRUE(reader.at_end());
  return state;
}

void expect_the_same_life(GasGrid& gas, int from) {
  for (int frame = from + 1; frame < kFrames; ++frame) {
    step(gas, frame - 1);
    push(gas, frame);
    ASSERT_EQ(first_difference(gas.state(), state_at(frame)), "") << from << ' ' << frame;
  }
}

TEST(GasGridState, ANewGridGoesOnFromRandomMomentsToTheBit) {
  for (std::uint64_t i = 0; i < 5; ++i) {
    const int frame = static_cast<int>((kFrames - 5) * Random(1, 0).uniform(i));
    GasGrid gas(cavity());
    const GasGrid::State state = state_at(frame);
    ASSERT_TRUE(gas.fits(state));
    gas.restore(state);
    EXPECT_EQ(first_difference(gas.state(), state), "") << frame;
    expect_the_same_life(gas, frame);
  }
}

TEST(GasGridState, AGridThatLivedOtherwiseGoesOnFromRandomMomentsToTheBit) {
  GasGrid gas(cavity());
  for (int frame = 100; frame < 120; ++frame) {
    push(gas, frame);
    step(gas, frame);
  }
  for (const int frame : {41, 3, 28}) {
    gas.restore(state_at(frame));
    expect_the_same_life(gas, frame);
  }
}

TEST(GasGridState, WhatIsLookedAtBetweenStepsIsTheSame) {
  GasGrid gas(cavity()), other(cavity());
  for (int frame = 0; frame < 9; ++frame) {
    push(gas, frame);
    step(gas, frame);
  }
  push(gas, 9);
  other.restore(gas.state());
  EXPECT_EQ(other.momentum(), gas.momentum());
  EXPECT_EQ(other.energy(), gas.energy());
  EXPECT_EQ(other.divergence_error(), gas.divergence_error());
  EXPECT_EQ(other.report().leaks, gas.report().leaks);
  EXPECT_EQ(other.at_rest(), gas.at_rest());
  EXPECT_EQ(other.holds_any(), gas.holds_any());
  EXPECT_EQ(other.excess(Vec3(-0.03, 0.0, 0.41)), gas.excess(Vec3(-0.03, 0.0, 0.41)));
  EXPECT_GT(gas.excess(Vec3(-0.03, 0.0, 0.41)), 0.0);
  const Vec3 at(0.01, 0.02, 0.4);
  EXPECT_EQ(other.velocity(at), gas.velocity(at));
}

TEST(GasGridState, WallsThatWereSlowedStaySlow) {
  GasParameters parameters = cavity();
  parameters.most_speed = 0.05;
  GasGrid gas(parameters), other(parameters);
  move_organ(gas, 0, 0.4);
  gas.step(kFrame);
  other.restore(gas.state());
  for (int i = 0; i < 3; ++i) {
    gas.step(kFrame);
    other.step(kFrame);
    EXPECT_EQ(first_difference(other.state(), gas.state()), "");
  }
}

TEST(GasGridState, GasAtRestStaysAtRest) {
  GasGrid gas(cavity()), other(cavity());
  step(other, 0);
  other.restore(gas.state());
  EXPECT_TRUE(other.at_rest());
  EXPECT_FALSE(other.step(kFrame).moved);
  EXPECT_EQ(first_difference(other.state(), gas.state()), "");
}

TEST(GasGridState, ImpulsesThatAreGivenTakeNoRoomInIt) {
  GasGrid gas(cavity());
  push(gas, 0);
  EXPECT_GT(gas.state().impulse[0].size(), 0u);
  gas.step(kFrame);
  EXPECT_EQ(gas.state().impulse[0].size(), 0u);
}

TEST(GasGridState, BytesThatEndEarlyAreRefusedAndChangeNothing) {
  const std::vector<std::byte>& bytes = one_life()[20];
  GasGrid gas(cavity());
  step(gas, 0);
  const std::vector<std::byte> before = saved(gas);
  for (std::uint64_t i = 0; i < 200; ++i) {
    const auto size =
        static_cast<std::size_t>(static_cast<double>(bytes.size()) * Random(3, 0).uniform(i));
    ByteReader reader(std::span<const std::byte>(bytes).first(size));
    read(reader, gas);
    EXPECT_TRUE(reader.failed()) << size;
  }
  EXPECT_EQ(saved(gas), before);
}

TEST(GasGridState, WhatIsNotOfSuchAGridDoesNotFit) {
  const GasGrid gas(cavity()), finer(cavity(21));
  EXPECT_FALSE(finer.fits(state_at(20)));
  const auto fits_after = [&](const std::function<void(GasGrid::State&)>& change) {
    GasGrid::State state = state_at(20);
    change(state);
    return gas.fits(state);
  };
  using State = GasGrid::State;
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_TRUE(fits_after([](State&) {}));
  EXPECT_FALSE(fits_after([](State& s) { s.solid.pop_back(); }));
  EXPECT_FALSE(fits_after([](State& s) { s.solid_velocity.resize(5); }));
  EXPECT_FALSE(fits_after([](State& s) { s.velocity[1].clear(); }));
  EXPECT_FALSE(fits_after([](State& s) { s.potential.push_back(0.0f); }));
  EXPECT_FALSE(fits_after([](State& s) { s.impulse[2].clear(); }));
  EXPECT_FALSE(fits_after([](State& s) { s.impulse = {}; }));
  EXPECT_FALSE(fits_after([](State& s) { s.report.leaks.clear(); }));
  EXPECT_FALSE(fits_after([](State& s) { s.inlets.push_back({}); }));
  EXPECT_FALSE(fits_after([](State& s) { s.inlets.front().position.x() = kNan; }));
  EXPECT_FALSE(fits_after([](State& s) { s.evacuators.front().radius = 1.0 / 0.0; }));
  EXPECT_FALSE(fits_after([](State& s) { s.leaks.front().position.y() = kNan; }));
  EXPECT_FALSE(fits_after([](State& s) { s.contents.of[kGasHeat].resize(3); }));
  EXPECT_FALSE(fits_after([](State& s) { s.sources.push_back({.gift = {.heat = kNan}}); }));
}

}  // namespace
}  // namespace viscera
