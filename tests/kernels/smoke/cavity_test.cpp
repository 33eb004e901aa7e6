#include "kernels/smoke/cavity.h"

#include <gtest/gtest.h>

#include <cmath>

namespace viscera {
namespace {

constexpr double kFrame = 1.0 / 60.0;
constexpr double kLitreAMinute = 1e-3 / 60.0;
constexpr double kMillimetreOfMercury = 133.322;

CavityParameters twelve() {
  CavityParameters parameters;
  parameters.set_pressure = 12.0 * kMillimetreOfMercury;
  return parameters;
}

void run(Cavity& cavity, const Cavity::Demand& demand, double time) {
  for (double t = 0.0; t < time; t += kFrame) cavity.step(demand, kFrame);
}

TEST(Cavity, AHoleLetsOutWhatTorricelliSays) {
  const Cavity cavity(twelve());
  // 3 mm of radius: over forty litres a minute.
  EXPECT_NEAR(cavity.leak(M_PI * 9e-6, 12.0 * kMillimetreOfMercury) / kLitreAMinute, 44.0, 1.0);
  EXPECT_NEAR(cavity.leak(1.3e-6, 12.0 * kMillimetreOfMercury) / kLitreAMinute, 2.0, 0.1);
  EXPECT_LT(cavity.leak(1e-6, -100.0), 0.0);
  EXPECT_EQ(cavity.leak(1e-6, 0.0), 0.0);
}

TEST(Cavity, TheInsufflatorKeepsItsPressureAgainstALeak) {
  Cavity cavity(twelve());
  const double area = 1.3e-6;
  run(cavity, {.insufflator = 10.0 * kLitreAMinute, .leaks = {&area, 1}}, 5.0);
  EXPECT_NEAR(cavity.pressure(), 12.0 * kMillimetreOfMercury, 0.1 * kMillimetreOfMercury);
  EXPECT_NEAR(cavity.state().insufflation, cavity.state().leaks[0], 1e-4 * cavity.state().leaks[0]);
  EXPECT_NEAR(cavity.volume(), 3e-3, 0.02e-3);
}

TEST(Cavity, WhatIsDrawnOverTheInsufflatorsLimitCostsPressureAndNoAirComesInWhileThereIsAny) {
  Cavity cavity(twelve());
  const double area = 1.3e-6;
  const Cavity::Demand demand = {
      .insufflator = 3.0 * kLitreAMinute, .evacuators = 10.0 * kLitreAMinute, .leaks = {&area, 1}};
  double before = cavity.pressure();
  for (int frame = 0; frame < 300; ++frame) {
    cavity.step(demand, kFrame);
    ASSERT_LT(cavity.pressure(), before);
    ASSERT_GT(cavity.state().leaks[0], 0.0) << cavity.pressure();
    before = cavity.pressure();
  }
  EXPECT_EQ(cavity.state().book.air, 0.0);
  EXPECT_EQ(cavity.state().insufflation, demand.insufflator);
  // In the end the wall lies on the evacuator's tip, and air comes in.
  run(cavity, demand, 60.0);
  EXPECT_LT(cavity.pressure(), 0.0);
  EXPECT_GT(cavity.pressure(), -kMillimetreOfMercury);
  EXPECT_LT(cavity.state().drawn, 1.0);
  EXPECT_GT(cavity.state().book.air, 0.0);
}

TEST(Cavity, TheWallYieldsByItsCompliance) {
  Cavity cavity(twelve());
  // Closed, half a litre drawn off; gas itself is 4 % of what yields.
  run(cavity, {.evacuators = 30.0 * kLitreAMinute}, 1.0 - 0.5 * kFrame);
  const double yields = 1.27e-3 / 1600.0 + 3e-3 / 102925.0;
  EXPECT_NEAR(12.0 * kMillimetreOfMercury - cavity.pressure(), 0.5e-3 / yields, 0.02 * 600.0);
  EXPECT_NEAR(cavity.volume(), 3e-3 - 0.96 * 0.5e-3, 0.01e-3);
}

TEST(Cavity, SteamRaisesThePressureOfAClosedCavity) {
  Cavity cavity(twelve());
  run(cavity, {.swelling = 15e-6}, 10.0 - 0.5 * kFrame);
  const double yields = 1.27e-3 / 1600.0 + 3e-3 / 102925.0;
  EXPECT_NEAR(cavity.pressure() - 12.0 * kMillimetreOfMercury, 150e-6 / yields, 2.0);
}

TEST(Cavity, ItsBookClosesForAnyStep) {
  for (const double dt : {1e-4, kFrame, 1.0, 100.0}) {
    Cavity cavity(twelve());
    const std::vector<double> areas = {0.5e-6, 20e-6};
    for (int step = 0; step < 200; ++step) {
      const bool drawing = step % 60 > 20;
      cavity.step({.insufflator = 5.0 * kLitreAMinute,
                   .evacuators = drawing ? 15.0 * kLitreAMinute : 0.0,
                   .leaks = areas,
                   .swelling = step % 7 == 0 ? 2e-5 : -1e-6},
                  dt);
      const CavityBook& book = cavity.state().book;
      ASSERT_NEAR(3e-3 + book.insufflated + book.swollen + book.air,
                  cavity.state().gas + book.evacuated + book.leaked,
                  1e-12 * (3e-3 + book.insufflated + book.leaked + book.evacuated));
      ASSERT_TRUE(cavity.fits(cavity.state()));
      // And what is counted is what is there.
      const double scale =
          (gas::kAtmosphere + cavity.pressure()) / (gas::kAtmosphere + 12.0 * kMillimetreOfMercury);
      ASSERT_NEAR(cavity.volume() * scale, cavity.state().gas, 1e-9);
    }
  }
}

}  // namespace
}  // namespace viscera
