#include "kernels/heat/damage.h"

#include <gtest/gtest.h>

#include <cmath>
#include <utility>

#include "engine/verification/heat_solutions.h"

namespace viscera {
namespace {

// One brick alone, all at one temperature that `celsius` gives for a time.
double omega_after(const ArrheniusLaw& law, double seconds, double dt,
                   const std::function<double(double)>& celsius) {
  ThermalTissue tissue = plain_tissue();
  tissue.damage = law;
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
  return heat.bricks().damage_at({2, 5, 7});
}

/// Of liver, 7.39e39 / s and 257.7 kJ/mol, apart from the program [1/s].
double liver_rate(double celsius) {
  return 7.39e39 * std::exp(-2.577e5 / (8.314462618 * (celsius + 273.15)));
}

TEST(Damage, AtConstantTemperatureIsArrheniusTimesTime) {
  const ArrheniusLaw liver = ThermalTissue{}.damage;
  // A exp(-E / (R T)) worked out apart from the program; what 37 C would do doesn't count.
  for (const auto& [celsius, rate] : {std::pair{45.0, 0.003627925913},
                                      {55.0, 0.07062799748},
                                      {65.0, 1.153554675},
                                      {80.0, 56.60027887}}) {
    const double seconds = 3.0;
    const double net = rate - 0.000293996165;
    const double omega = omega_after(liver, seconds, 1.0 / 60.0, [&](double) { return celsius; });
    EXPECT_NEAR(omega, net * seconds, 1e-3 * net * seconds) << celsius;
  }
}

TEST(Damage, OfAnotherTissueFollowsItsOwnLaw) {
  const ArrheniusLaw artery{5.6e63, 4.3e5};
  const double omega = omega_after(artery, 1.0, 1.0 / 60.0, [](double) { return 70.0; });
  EXPECT_NEAR(omega, 0.01969841, 2e-3 * omega);
}

TEST(Damage, WhileItWarmsDoesntDependOnTheStep) {
  const ArrheniusLaw liver = ThermalTissue{}.damage;
  // 20 K a second, as near an electrode: the rate grows a thousandfold in the two seconds.
  const auto ramp = [](double t) { return 45.0 + 20.0 * t; };
  double exact = 0.0;
  const int parts = 100000;
  for (int i = 0; i < parts; ++i)
    exact += (liver_rate(ramp((i + 0.5) * 2.0 / parts)) - liver_rate(37.0)) * 2.0 / parts;
  EXPECT_NEAR(omega_after(liver, 2.0, 1.0 / 60.0, ramp), exact, 1e-3 * exact);
  EXPECT_NEAR(omega_after(liver, 2.0, 0.25, ramp), exact, 0.01 * exact);
}

TEST(Damage, LivingTissueAtRestStaysSound) {
  const ArrheniusLaw liver = ThermalTissue{}.damage;
  EXPECT_EQ(omega_after(liver, 30.0, 0.1, [](double) { return 37.5; }), 0.0);
}

TEST(Damage, SoundTissueIsPinkWetAndSoft) {
  const TissueState sound = tissue_state(0.0, 1.0, 0.0);
  EXPECT_EQ(sound.coagulated, 0.0);
  EXPECT_EQ(sound.seared, 0.0);
  EXPECT_EQ(sound.wetness, 1.0);
  EXPECT_EQ(stiffness_factor(sound), 1.0);
  EXPECT_EQ(shrinkage(sound, 0.72), 1.0);
}

TEST(Damage, TissueTurnsPaleThenBrownThenBlack) {
  const TissueState pale = tissue_state(1.0, 1.0, 0.0);
  EXPECT_NEAR(pale.coagulated, 0.632, 1e-3);
  EXPECT_EQ(pale.seared, 0.0);
  const TissueState brown = tissue_state(10.0, 0.1, 0.0);
  EXPECT_GT(brown.seared, 0.8);
  EXPECT_LT(brown.wetness, 0.01);
  const TissueState black = tissue_state(10.0, 0.0, 1.0);
  EXPECT_EQ(black.charred, 1.0);
  EXPECT_EQ(black.seared, 0.0);
  EXPECT_EQ(black.wetness, 0.0);
}

TEST(Damage, StiffensAndShrinksMonotonically) {
  double stiff = 1.0, length = 1.0;
  for (const double damage : {0.1, 0.5, 1.0, 3.0}) {
    const TissueState state = tissue_state(damage, 1.0, 0.0);
    EXPECT_GT(stiffness_factor(state), stiff);
    EXPECT_LT(shrinkage(state, 0.72), length);
    stiff = stiffness_factor(state);
    length = shrinkage(state, 0.72);
  }
  EXPECT_LT(stiff, 4.01);
  EXPECT_LT(shrinkage(tissue_state(5.0, 0.0, 0.0), 0.72), length);
}

TEST(Damage, OnlyVeryHotTissueGlows) {
  EXPECT_EQ(glow(700.0), 0.0);
  EXPECT_NEAR(glow(1000.0), 1.0, 1e-9);
  EXPECT_GT(glow(1200.0), 10.0);
}

}  // namespace
}  // namespace viscera
