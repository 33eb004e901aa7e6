#include "engine/verification/uniaxial.h"

#include <gtest/gtest.h>

#include <cmath>

namespace viscera {
namespace {

constexpr IsotropicMaterial kRubber{10e3, 0.45};

/// Energy over volume of a bar with these stretches.
double energy(double l, double t) {
  const double mu = kRubber.shear_modulus(), lambda = kRubber.lame_lambda(), j = l * t * t;
  return 0.5 * mu * (l * l + 2.0 * t * t - 3.0) - mu * (j - 1.0) +
         0.5 * (lambda + mu) * (j - 1.0) * (j - 1.0);
}

TEST(Uniaxial, SmallStrainsAreAnsweredByYoungsModulusAndPoissonsRatio) {
  const UniaxialAnswer answer = uniaxial(kRubber, 1.0 - 1e-6);
  EXPECT_NEAR(answer.nominal, -1e-6 * 10e3, 1e-5 * 1e-2);
  EXPECT_NEAR(answer.across - 1.0, 0.45e-6, 1e-5 * 0.45e-6 + 1e-11);
}

TEST(Uniaxial, TheSidesLieWhereTheEnergyIsLeastAndTheForceIsItsSlope) {
  for (const double stretch : {0.3, 0.5, 0.8, 1.4}) {
    const UniaxialAnswer answer = uniaxial(kRubber, stretch);
    const double least = energy(stretch, answer.across), h = 1e-5;
    EXPECT_GT(energy(stretch, answer.across + 1e-3), least);
    EXPECT_GT(energy(stretch, answer.across - 1e-3), least);
    const double slope =
        (energy(stretch + h, answer.across) - energy(stretch - h, answer.across)) / (2.0 * h);
    EXPECT_NEAR(answer.nominal, slope, 1e-6 * 10e3);
  }
}

TEST(Uniaxial, APressureIsThatOfItsStretch) {
  const UniaxialAnswer answer = pressed_to(kRubber, 10e3);
  EXPECT_NEAR(answer.pressure, 10e3, 1e-6);
  EXPECT_NEAR(uniaxial(kRubber, answer.stretch).pressure, 10e3, 1e-6);
  EXPECT_LT(answer.stretch, 0.4);
}

}  // namespace
}  // namespace viscera
