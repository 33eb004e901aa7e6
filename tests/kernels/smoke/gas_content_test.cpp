#include "kernels/smoke/gas_content.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>

#include "kernels/smoke/gas_grid.h"

namespace viscera {
namespace {

constexpr double kFrame = 1.0 / 60.0;
constexpr double kLitreAMinute = 1e-3 / 60.0;

GasParameters cavity() {
  GasParameters parameters;
  parameters.domain = Box(Vec3(-0.05, -0.05, 0.3), Vec3(0.05, 0.05, 0.4));
  parameters.cells = 20;
  return parameters;
}

// --- transport alone ----------------------------------------------------------------------------

/// A box of cells with a flow that nothing solves for.
struct Channel {
  GasLayout layout;
  GasFaces velocity, passes;
  std::vector<std::uint8_t> solid;
  std::vector<float> sinks, walls, to_walls;
  GasContents contents;
  GasTransport::Flow flow;

  Channel(const std::array<int, 3>& n, const std::function<Vec3(const Vec3&)>& field, double cell)
      : layout(n) {
    const auto count = static_cast<std::size_t>(layout.count);
    solid.assign(count, 0);
    sinks.assign(count, 0.0f);
    walls.assign(count, 0.0f);
    to_walls.assign(count, 0.0f);
    contents.of[kGasAir].assign(count, 0.0f);
    for (int axis = 0; axis < 3; ++axis) {
      velocity[axis].assign(count, 0.0f);
      passes[axis].assign(count, 0.0f);
      for (int k = 0; k < layout.faces(axis, 2); ++k)
        for (int j = 0; j < layout.faces(axis, 1); ++j)
          for (int i = 0; i < layout.faces(axis, 0); ++i) {
            const std::array<int, 3> at{i, j, k};
            if (at[axis] == 0 || at[axis] == n[axis]) continue;
            const auto f = static_cast<std::size_t>(layout.index(i, j, k));
            passes[axis][f] = 1.0f;
            Vec3 place = cell * (Vec3(i, j, k) + Vec3::Constant(0.5));
            place[axis] -= 0.5 * cell;
            velocity[axis][f] = static_cast<float>(field(place)[axis]);
          }
    }
    flow = {.velocity = &velocity,
            .passes = &passes,
            .solid = solid,
            .sinks = sinks,
            .walls = walls,
            .spacing = Vec3::Constant(cell)};
  }

  float& air(int i, int j, int k) {
    return contents.of[kGasAir][static_cast<std::size_t>(layout.index(i, j, k))];
  }
  double sum() const { return contents.stored(layout, 1.0).air; }
  GasTransport::Outcome move(double dt) {
    GasTransport transport(layout);
    return transport.move(flow, {1e-6f, 1e-6f, 1e-6f, 1e-6f}, dt, contents, to_walls);
  }
};

TEST(GasTransport, ABlobGoesAsFarAsTheFlowAndKeepsItsAmount) {
  const Vec3 speed(0.1, 0.0, 0.0);
  Channel channel(
      {40, 8, 8}, [&](const Vec3&) { return speed; }, 5e-3);
  const auto middle = [&] {
    double sum = 0.0, at = 0.0;
    for (int i = 0; i < 40; ++i)
      for (int j = 0; j < 8; ++j)
        for (int k = 0; k < 8; ++k) {
          sum += channel.air(i, j, k);
          at += (i + 0.5) * 5e-3 * channel.air(i, j, k);
        }
    return at / sum;
  };
  for (int i = 4; i < 12; ++i)
    for (int j = 2; j < 6; ++j)
      for (int k = 2; k < 6; ++k)
        channel.air(i, j, k) = static_cast<float>(std::pow(std::sin(M_PI * (i - 3.5) / 8.0), 2));
  const double before = channel.sum(), start = middle();
  for (int step = 0; step < 48; ++step) channel.move(kFrame);
  EXPECT_NEAR(channel.sum(), before, 1e-6 * before);
  EXPECT_NEAR(middle() - start, 48.0 * kFrame * speed.x(), 2e-4);
  float most = 0.0f;
  for (const float value : channel.contents.of[kGasAir]) {
    ASSERT_GE(value, 0.0f);
    most = std::max(most, value);
  }
  EXPECT_LE(most, 1.0f);
  EXPECT_GT(most, 0.6f) << "first order would have left a third";
}

TEST(GasTransport, WhatIsEvenStaysEvenInAVortex) {
  Channel channel(
      {16, 16, 6},
      [](const Vec3& at) {
        const double k = M_PI / (16 * 5e-3);
        return Vec3(0.2 * std::sin(k * at.x()) * std::cos(k * at.y()),
                    -0.2 * std::cos(k * at.x()) * std::sin(k * at.y()), 0.0);
      },
      5e-3);
  channel.layout.rows([&](std::ptrdiff_t c, int length, int, int) {
    for (std::ptrdiff_t i = c; i < c + length; ++i)
      channel.contents.of[kGasAir][static_cast<std::size_t>(i)] = 0.5f;
  });
  for (int step = 0; step < 30; ++step) EXPECT_GT(channel.move(kFrame).substeps, 0);
  // The field's divergence on the grid isn't quite 0.
  channel.layout.rows([&](std::ptrdiff_t c, int length, int, int) {
    for (std::ptrdiff_t i = c; i < c + length; ++i)
      ASSERT_NEAR(channel.contents.of[kGasAir][static_cast<std::size_t>(i)], 0.5f, 5e-3f);
  });
}

TEST(GasTransport, DiffusionSpreadsAsTheRootOfTime) {
  Channel channel(
      {40, 40, 40}, [](const Vec3&) { return Vec3(0, 0, 0); }, 2e-3);
  channel.flow.diffusivity[kGasAir] = 2e-5;
  channel.air(20, 20, 20) = 1.0f;
  const double time = 0.8;
  for (int step = 0; step < 80; ++step) channel.move(0.01);
  double square = 0.0;
  for (int i = 0; i < 40; ++i)
    for (int j = 0; j < 40; ++j)
      for (int k = 0; k < 40; ++k)
        square += std::pow((i - 20) * 2e-3, 2) * channel.air(i, j, k) / channel.sum();
  EXPECT_NEAR(square, 2.0 * 2e-5 * time, 0.02 * square);
  EXPECT_NEAR(channel.sum(), 1.0, 1e-5);
}

TEST(GasTransport, GasThatIsTooFastIsHeldAndNothingIsLost) {
  Channel channel(
      {60, 4, 4}, [](const Vec3&) { return Vec3(50.0, 0.0, 0.0); }, 5e-3);
  channel.air(5, 1, 1) = 1.0f;
  const GasTransport::Outcome outcome = channel.move(kFrame);
  EXPECT_EQ(outcome.substeps, GasTransport::kMostSubsteps);
  EXPECT_GT(outcome.slowed, 0u);
  EXPECT_NEAR(channel.sum(), 1.0, 1e-6);
  for (const float value : channel.contents.of[kGasAir]) ASSERT_GE(value, 0.0f);
  EXPECT_LT(channel.air(5, 1, 1), 0.1f);
}

// --- in the gas ---------------------------------------------------------------------------------

double energy(const GasContent& content) {
  return content.heat - gas::kLatentHeat * content.droplets;
}

/// 20 W of boiling for 0.3 s, then rest; an inlet, an evacuator, a leak and an organ.
TEST(GasContents, BooksOfHeatWaterAndAirClose) {
  GasGrid gas(cavity());
  const GasMixture& mixture = gas.parameters().mixture;
  std::vector<std::uint8_t> solid;
  for (int k = 0; k < 20; ++k)
    for (int j = 0; j < 20; ++j)
      for (int i = 0; i < 20; ++i) solid.push_back(k < 4 + (i > 10));
  gas.set_solids(solid);
  const GasInlet in = {.position = Vec3(-0.04, 0.0, 0.38), .flow = 3.0 * kLitreAMinute};
  const GasEvacuator out = {.position = Vec3(0.03, 0.0, 0.36), .flow = 6.0 * kLitreAMinute};
  const GasLeak leak = {.position = Vec3(0.0, 0.045, 0.39), .flow = -2.0 * kLitreAMinute};
  gas.set_inlets({&in, 1});
  gas.set_evacuators({&out, 1});
  gas.set_leaks({&leak, 1});
  double water = 0.0, heat = 0.0, most_fog = 0.0;
  for (int step = 0; step < 90; ++step) {
    if (step < 18) {
      const GasGift steam = GasGift::steam(mixture, 20.0 / 2.26e6 * kFrame, 373.15);
      ASSERT_TRUE(gas.give({.position = Vec3(0.0, 0.0, 0.325), .impulse = 1e-7, .gift = steam}));
      water += steam.vapour;
      heat += steam.heat;
    }
    gas.step(kFrame);
    if (step == 40) {  // an organ comes over what is warm
      for (std::size_t c = 0; c < solid.size(); ++c) solid[c] = solid[c] || c / 400 < 6;
      gas.set_solids(solid);
    }
    const GasContent held = gas.stored();
    const GasBook& book = gas.book();
    most_fog = std::max(most_fog, held.droplets);
    ASSERT_NEAR(held.vapour + held.droplets + book.water_out, water, 1e-5 * water) << step;
    ASSERT_NEAR(energy(held) + book.heat_to_walls + book.heat_out, heat,
                1e-5 * gas::kLatentHeat * water)
        << step;
    ASSERT_NEAR(held.air + book.air_out, book.air_given, 1e-5 * book.air_given) << step;
  }
  const GasBook& book = gas.book();
  EXPECT_NEAR(book.water_given, water, 1e-12 * water);
  EXPECT_NEAR(book.heat_given, heat, 1e-12 * heat);
  EXPECT_NEAR(book.air_given,
              90 * kFrame * 2.0 * kLitreAMinute / mixture.volume_of(gas::kAirMolarMass), 1e-9);
  EXPECT_GT(book.heat_to_walls, 0.02 * heat);
  EXPECT_GT(book.water_out, 0.01 * water);
  EXPECT_GT(most_fog, 0.01 * water) << "steam that mixes with cooler gas is seen";
  EXPECT_LT(gas.stored().droplets, 0.02 * most_fog) << "and goes as it mixes with dry gas";
}

TEST(GasContents, FlowsBalanceWithWhatSwells) {
  GasParameters parameters = cavity();
  parameters.open[5] = true;
  GasGrid gas(parameters);
  double swollen = 0.0, left = 0.0;
  const GasGift steam = GasGift::steam(parameters.mixture, 20.0 / 2.26e6 * kFrame, 373.15);
  for (int step = 0; step < 60; ++step) {
    ASSERT_TRUE(gas.give({.position = Vec3(0.0, 0.0, 0.32), .gift = steam}));
    const GasReport& report = gas.step(kFrame);
    swollen += report.swelling * kFrame;
    left += report.sides[5] * kFrame;
    ASSERT_LT(gas.divergence_error(), 2e-3);
    if (step == 0) {
      // Steam alone, and what of it condensed at once and warmed the rest.
      EXPECT_GT(report.swelling * kFrame, steam.volume);
      EXPECT_LT(report.swelling * kFrame, 2.0 * steam.volume);
    }
  }
  EXPECT_NEAR(left, swollen, 1e-3 * swollen);
  EXPECT_GT(swollen, 60 * steam.volume);
}

TEST(GasContents, ABubbleOfSteamRisesAndOneOfFogInColdGasSinks) {
  const auto rise = [](const GasGift& gift) {
    GasGrid gas(cavity());
    EXPECT_TRUE(gas.give({.position = Vec3(0.0, 0.0, 0.35), .gift = gift}));
    for (int step = 0; step < 6; ++step) gas.step(kFrame);
    return gas.velocity(Vec3(0.0, 0.0, 0.35)).z();
  };
  const GasMixture mixture;
  EXPECT_GT(rise(GasGift::warmth(mixture, 0.05)), 0.01);
  EXPECT_GT(rise(GasGift::steam(mixture, 1e-6, 373.15)), 0.01);
  EXPECT_LT(rise(GasGift::warmth(mixture, -0.02)), -0.005);
}

TEST(GasContents, WallsCoolGasUntilItRestsAndNothingIsLeft) {
  GasParameters parameters = cavity();
  parameters.domain = Box(Vec3::Zero(), Vec3::Constant(0.02));
  parameters.cells = 8;
  GasGrid gas(parameters);
  ASSERT_TRUE(gas.give(
      {.position = Vec3::Constant(0.01), .gift = GasGift::warmth(parameters.mixture, 0.1)}));
  double cooled = 0.0;
  int steps = 0;
  for (; steps < 4000 && (steps == 0 || gas.holds_any()); ++steps) {
    gas.step(kFrame);
    cooled += gas.report().swelling * kFrame;
  }
  EXPECT_FALSE(gas.holds_any());
  EXPECT_NEAR(gas.book().heat_to_walls, 0.1, 2e-3);
  EXPECT_NEAR(cooled, 0.0, 0.02 * 0.1 / parameters.mixture.full_heat());
  for (int i = 0; i < 2000 && !gas.at_rest(); ++i) gas.step(kFrame);
  EXPECT_TRUE(gas.at_rest());
}

TEST(GasContents, EddiesAreAsFastAsTheStrainMakesThem) {
  GasParameters parameters = cavity();
  parameters.open.fill(true);
  parameters.kinematic_viscosity = parameters.eddy_viscosity = 0.0;
  GasGrid gas(parameters);
  constexpr double kShear = 10.0;
  gas.set_velocity([](const Vec3& at) { return Vec3(kShear * (at.z() - 0.35), 0.0, 0.0); });
  gas.step(1e-5);
  const std::vector<Vec3f> places = {Vec3f(0.0f, 0.0f, 0.35f), Vec3f(0.01f, 0.02f, 0.36f)};
  std::vector<float> speeds(places.size());
  gas.place({.places = StridedVectors<const float>(std::span<const Vec3f>(places))});
  gas.eddies(speeds);
  const double cell = gas.spacing().x();
  for (const float speed : speeds)
    EXPECT_NEAR(speed, std::sqrt(2.0 / 3.0) * 0.17 * 0.17 / 0.094 * cell * kShear, 1e-3 * speed);
}

TEST(GasContents, WhatHasNoGasInReachOrIsNoNumberIsNotTaken) {
  GasGrid gas(cavity());
  const GasGift heat = GasGift::warmth(gas.parameters().mixture, 1e-3);
  EXPECT_FALSE(gas.give({.position = Vec3(1.0, 0.0, 0.35), .gift = heat}));
  EXPECT_FALSE(gas.give({.position = Vec3(0.0, 0.0, 0.35), .gift = {.heat = 0.0 / 0.0}}));
  EXPECT_FALSE(gas.give({.position = Vec3(0.0, 0.0, 0.35), .gift = {.vapour = -1e-6}}));
  EXPECT_FALSE(gas.holds_any());
  EXPECT_FALSE(gas.step(kFrame).moved);
}

}  // namespace
}  // namespace viscera
