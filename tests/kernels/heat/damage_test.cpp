#include "kernels/heat/damage.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <utility>

#include "engine/verification/heat_solutions.h"

namespace viscera {
namespace {

constexpr double kGas = 8.314462618;  // [J/(mol K)]
constexpr double kMinute = 60.0, kHour = 3600.0;

/// What heat has made of one place.
struct Harm {
  double dose = 0.0, coagulation = 0.0, collagen = 0.0;
};

/// One brick alone, whose values don't change with temperature, but that is harmed as liver is.
ThermalTissue liver() {
  ThermalTissue tissue = plain_tissue();
  tissue.coagulation = ThermalTissue{}.coagulation;
  tissue.collagen = ThermalTissue{}.collagen;
  return tissue;
}

/// All of it at one temperature that `celsius` gives for a time.
Harm harm_after(const ThermalTissue& tissue, double seconds, double dt,
                const std::function<double(double)>& celsius) {
  BioheatOptions options;
  options.cooling.coefficient = 0.0;
  Bioheat heat(tissue, options, [](const Vec3& p) {
    return (p - Vec3::Constant(2e-3)).cwiseAbs().maxCoeff() - 2e-3;
  });
  set_excess(heat, Box(Vec3::Constant(1e-3), Vec3::Constant(2e-3)),
             [&](const Vec3&) { return celsius(0.0) - 37.0; });
  for (int step = 0; step < std::lround(seconds / dt); ++step) {
    const double rise = celsius((step + 1) * dt) - celsius(step * dt);
    heat_evenly(heat, rise * heat_capacity(tissue, 1.0) * tissue_volume(heat), dt);
    heat.step(dt);
  }
  const BrickIndex place(2, 5, 7);
  return {heat.bricks().dose_at(place), heat.bricks().coagulation_at(place),
          heat.bricks().collagen_at(place)};
}

Harm harm_at(double celsius, double seconds, int steps = 50) {
  return harm_after(liver(), seconds, seconds / steps, [=](double) { return celsius; });
}

TEST(Death, ComesAfterTheTimeThatTheThermalDoseGives) {
  for (int celsius = 43; celsius <= 55; celsius += 2) {
    const double lethal = 240.0 * kMinute * std::pow(0.5, celsius - 43);
    // The dose is 1 when it kills; it grows evenly at one temperature.
    EXPECT_NEAR(harm_at(celsius, lethal).dose, 1.0, 1e-3) << celsius;
    EXPECT_NEAR(harm_at(celsius, 0.5 * lethal).dose, 0.5, 1e-3) << celsius;
  }
}

TEST(Death, BelowTheKneeTakesFourTimesAsLongForEveryKelvin) {
  EXPECT_NEAR(harm_at(41.0, kHour).dose, 0.25 / 16.0, 1e-4);
  EXPECT_NEAR(harm_at(42.0, kHour).dose, 0.25 / 4.0, 1e-4);
}

TEST(Death, WhileItWarmsDoesntDependOnTheStep) {
  // From 41 C through the knee to 53 C in half a minute.
  const auto ramp = [](double t) { return 41.0 + 0.4 * t; };
  double exact = 0.0;
  const int parts = 100000;
  for (int i = 0; i < parts; ++i) {
    const double over = ramp((i + 0.5) * 30.0 / parts) - 43.0;
    exact += std::pow(over < 0.0 ? 4.0 : 2.0, over) * 30.0 / parts / (240.0 * kMinute);
  }
  EXPECT_NEAR(harm_after(liver(), 30.0, 1.0 / 60.0, ramp).dose, exact, 2e-3 * exact);
  EXPECT_NEAR(harm_after(liver(), 30.0, 0.5, ramp).dose, exact, 2e-3 * exact);
}

TEST(Harm, SoundTissueAtRestStaysSoundForADay) {
  ThermalTissue hasty = liver();
  hasty.coagulation = {7.39e39, 2.577e5};  // by which liver at 37 C would be gone within the hour
  for (const ThermalTissue& tissue : {liver(), hasty}) {
    for (const double celsius : {37.0, 37.5, 38.9}) {
      const Harm harm =
          harm_after(tissue, 24.0 * kHour, 5.0 * kMinute, [=](double) { return celsius; });
      EXPECT_EQ(harm.dose, 0.0) << celsius;
      EXPECT_EQ(harm.coagulation, 0.0) << celsius;
      EXPECT_EQ(harm.collagen, 0.0) << celsius;
    }
    EXPECT_LT(harm_after(tissue, kHour, kMinute, [](double) { return 41.0; }).dose, 0.02)
        << "an hour of fever kills nothing";
  }
}

TEST(Harm, ComesInTheOrderOfWhatItTakes) {
  // Some seconds at 52 C kill, at 65 C shrink hardly, at 75 C blanch and shrink.
  const Harm warm = harm_at(52.0, 40.0), hot = harm_at(75.0, 4.0);
  EXPECT_GT(warm.dose, 1.0);
  EXPECT_LT(coagulated_share(warm.coagulation), 0.15);
  EXPECT_LT(collagen_shrinkage(warm.collagen), 0.005);
  EXPECT_GT(hot.dose, 1.0);
  EXPECT_GT(coagulated_share(hot.coagulation), 0.6);
  EXPECT_GT(collagen_shrinkage(hot.collagen), 0.1);
}

TEST(Coagulation, AtConstantTemperatureIsArrheniusTimesTime) {
  // A exp(-E / (R T)) worked out apart from the program.
  for (const auto& [celsius, rate] :
       {std::pair{46.0, 0.0002756190}, {55.0, 0.004817204}, {65.0, 0.09677542}, {80.0, 6.336674}}) {
    const double omega = harm_at(celsius, 3.0, 180).coagulation;
    EXPECT_NEAR(omega, rate * 3.0, 1e-3 * rate * 3.0) << celsius;
  }
}

TEST(Coagulation, OfLiverIsHalfDoneWhenItsEnthalpyAndEntropySay) {
  // Eyring's rate k T / h exp(S / R - H / (R T)), where liver was measured.
  for (const double celsius : {45.0, 55.0, 60.0}) {
    const double kelvin = celsius + 273.15;
    const double rate = 2.0836619e10 * kelvin * std::exp(553.5 / kGas - 2.768e5 / (kGas * kelvin));
    const double half = std::log(2.0) / rate;
    EXPECT_NEAR(coagulated_share(harm_at(celsius, half).coagulation), 0.5, 0.01) << celsius;
  }
}

TEST(Coagulation, BeginsSoonerAndEndsLaterThanOneRateSays) {
  const auto time_to = [](double share) {
    double low = 1e-6, high = 1e6;  // Omega
    while (high > 1.0001 * low) {
      const double middle = std::sqrt(low * high);
      (coagulated_share(middle) < share ? low : high) = middle;
    }
    return low;
  };
  const auto one_rate = [](double share) { return -std::log1p(-share); };
  EXPECT_NEAR(time_to(0.5), one_rate(0.5), 0.01 * one_rate(0.5));
  EXPECT_LT(time_to(0.05), 0.5 * one_rate(0.05));
  EXPECT_GT(time_to(0.95), 4.0 * one_rate(0.95));
  EXPECT_EQ(coagulated_share(0.0), 0.0);
  EXPECT_EQ(coagulated_share(1e3), 1.0);
  EXPECT_NEAR(coagulated_share(299.9), 1.0, 1e-6) << "without a step where nothing is left";
}

TEST(Coagulation, OfAnotherTissueFollowsItsOwnLaw) {
  ThermalTissue artery = liver();
  artery.coagulation = {5.6e63, 4.3e5};
  const double omega = harm_after(artery, 1.0, 1.0 / 60.0, [](double) { return 70.0; }).coagulation;
  EXPECT_NEAR(omega, 0.01969841, 2e-3 * omega);
}

TEST(Coagulation, WhileItWarmsDoesntDependOnTheStep) {
  // 20 K a second, as near an electrode: the rate grows a thousandfold in the two seconds.
  const auto ramp = [](double t) { return 46.0 + 20.0 * t; };
  double exact = 0.0;
  const int parts = 100000;
  for (int i = 0; i < parts; ++i)
    exact += 5.53e41 * std::exp(-2.768e5 / (kGas * (ramp((i + 0.5) * 2.0 / parts) + 273.15))) *
             2.0 / parts;
  EXPECT_NEAR(harm_after(liver(), 2.0, 1.0 / 60.0, ramp).coagulation, exact, 1e-3 * exact);
  EXPECT_NEAR(harm_after(liver(), 2.0, 0.25, ramp).coagulation, exact, 0.01 * exact);
}

/// Where a law's rate is beyond what a number holds, it has still done all there is to do.
TEST(Coagulation, HoweverHotItGetsItIsComplete) {
  ThermalTissue skin = liver();
  skin.coagulation = {3.1e98, 6.28e5};
  for (const ThermalTissue& tissue : {liver(), skin}) {
    BioheatOptions options;
    options.cooling.coefficient = 0.0;
    Bioheat heat(tissue, options);
    HeatBrick& brick = *heat.bricks().warm_up({0, 0, 0});
    brick.water.fill(0.0f);
    for (int i = 0; i < BrickField::kVoxels; ++i)
      brick.warm->excess[i] = 200.0f + 2.0f * static_cast<float>(i);
    heat.step(1.0 / 60.0);
    for (int i = 0; i < BrickField::kVoxels; ++i) {
      EXPECT_EQ(coagulated_share(brick.coagulation[i]), 1.0) << i;
      EXPECT_GE(brick.dose[i], 1.0f) << i;
      EXPECT_GT(collagen_shrinkage(brick.collagen[i]), 0.19) << i;
      EXPECT_LT(collagen_shrinkage(brick.collagen[i]), 0.3) << i;
    }
  }
}

TEST(Collagen, OfLiverShrinksAsMeasuredIn15MinutesAt60To95C) {
  // [Rossmann2014], abstract; to heat the samples took some 150 s of the 15 minutes.
  for (const auto& [celsius, published] :
       {std::pair{60.0, 0.123}, {65.0, 0.138}, {75.0, 0.166}, {85.0, 0.192}, {95.0, 0.217}}) {
    const auto course = [celsius = celsius](double t) {
      return 37.0 + (celsius - 37.0) * std::min(1.0, t / 150.0);
    };
    const Harm harm = harm_after(liver(), 900.0, 1.0, course);
    EXPECT_NEAR(collagen_shrinkage(harm.collagen), published, 0.001) << celsius;
  }
}

TEST(Collagen, ShrinksAtOnceAndThenWithTheLogarithmOfTime) {
  const auto shrunk = [](double celsius, double seconds) {
    return collagen_shrinkage(harm_at(celsius, seconds).collagen);
  };
  EXPECT_LT(shrunk(60.0, 1.0), 0.005);
  EXPECT_GT(shrunk(60.0, 200.0), 0.11) << "the samples at 60 C had their step by then";
  EXPECT_GT(shrunk(75.0, 1.0), 0.1);
  EXPECT_NEAR(shrunk(80.0, 100.0) - shrunk(80.0, 10.0), shrunk(80.0, 10.0) - shrunk(80.0, 1.0),
              1e-4);
  EXPECT_EQ(collagen_shrinkage(0.0), 0.0);
}

TEST(Damage, SoundTissueIsPinkWetAndSoft) {
  const TissueState sound = tissue_state(0.0, 1.0, 0.0);
  EXPECT_EQ(sound.coagulated, 0.0);
  EXPECT_EQ(sound.seared, 0.0);
  EXPECT_EQ(sound.wetness, 1.0);
  EXPECT_EQ(stiffness_factor(sound), 1.0);
  EXPECT_EQ(remaining_length(sound, 0.0, 0.72), 1.0);
}

TEST(Damage, TissueTurnsPaleThenBrownThenBlack) {
  const TissueState pale = tissue_state(1.0, 1.0, 0.0);
  EXPECT_NEAR(pale.coagulated, 0.5615, 1e-3);
  EXPECT_EQ(pale.seared, 0.0);
  const TissueState brown = tissue_state(10.0, 0.1, 0.0);
  EXPECT_GT(brown.seared, 0.8);
  EXPECT_LT(brown.wetness, 0.01);
  const TissueState black = tissue_state(10.0, 0.0, 1.0);
  EXPECT_EQ(black.charred, 1.0);
  EXPECT_EQ(black.seared, 0.0);
  EXPECT_EQ(black.wetness, 0.0);
}

TEST(Damage, StiffensMonotonicallyAsFarAsAblatedLiverDoes) {
  double stiff = 1.0;
  for (const double coagulation : {0.1, 0.5, 1.0, 3.0, 30.0}) {
    const double factor = stiffness_factor(tissue_state(coagulation, 1.0, 0.0));
    EXPECT_GT(factor, stiff);
    stiff = factor;
  }
  EXPECT_NEAR(stiffness_factor(tissue_state(1e3, 1.0, 0.0)), 46.4 / 6.64, 0.02);
}

TEST(Damage, ShrinksByCollagenAndByTheWaterThatLeft) {
  double length = 1.0;
  const TissueState wet = tissue_state(5.0, 1.0, 0.0), dry = tissue_state(5.0, 0.0, 0.0);
  for (const double collagen : {1e-3, 0.02, 1.0, 1e3, 1e6}) {
    EXPECT_LT(remaining_length(wet, collagen, 0.72), length);
    length = remaining_length(wet, collagen, 0.72);
    EXPECT_NEAR(length, 1.0 - collagen_shrinkage(collagen), 1e-12);
    // Half of the water's volume closes, evenly in three directions.
    EXPECT_NEAR(remaining_length(dry, collagen, 0.72), length * std::cbrt(1.0 - 0.36), 1e-12);
  }
}

TEST(Damage, OnlyVeryHotTissueGlows) {
  EXPECT_EQ(glow(700.0), 0.0);
  EXPECT_NEAR(glow(1000.0), 1.0, 1e-9);
  EXPECT_GT(glow(1200.0), 10.0);
}

}  // namespace
}  // namespace viscera
