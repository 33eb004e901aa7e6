#include "kernels/smoke/gas_mixture.h"

#include <gtest/gtest.h>

#include <cmath>

namespace viscera {
namespace {

constexpr double kBoiling = 373.15;

/// Of an ideal gas [kg/m3].
double density_of(const GasMixture& mixture, double molar_mass, double kelvin) {
  return mixture.pressure * molar_mass / (gas::kGasConstant * kelvin);
}

TEST(GasMixture, RestsAsCarbonDioxideUnderPressure) {
  const GasMixture mixture;
  EXPECT_NEAR(mixture.density(), 1.757, 0.002);
  EXPECT_NEAR(gas::kViscosity / mixture.density() / mixture.heat_diffusivity(), 0.76, 0.02);
  EXPECT_NEAR(mixture.lewis(), 0.59, 0.02);
}

TEST(GasMixture, HotGasHasTheDensityOfAnIdealGas) {
  const GasMixture mixture;
  for (const double excess : {-20.0, 1.0, 63.0, 300.0, 1200.0}) {
    const GasContent hot{.heat = mixture.heat_of(excess)};
    const double exact = density_of(mixture, gas::kMolarMass, mixture.temperature + excess);
    EXPECT_NEAR(mixture.density() - mixture.lack(hot), exact, 1e-12);
    EXPECT_NEAR(mixture.excess_of(hot.heat), excess, 1e-9 * std::abs(excess));
  }
}

TEST(GasMixture, SteamAndAirWeighWhatTheyDoWhateverIsMixedIn) {
  const GasMixture mixture;
  const double steam = density_of(mixture, gas::kWaterMolarMass, kBoiling);
  const double air = density_of(mixture, gas::kAirMolarMass, mixture.temperature);
  EXPECT_NEAR(steam, 0.598, 0.002);
  const double hot = mixture.heat_of(kBoiling - mixture.temperature);
  EXPECT_NEAR(mixture.density() - mixture.lack({.heat = hot, .vapour = steam}), steam, 1e-12);
  EXPECT_NEAR(mixture.density() - mixture.lack({.air = air}), air, 1e-12);
  // Half of each by volume, and droplets besides.
  const GasContent mixed{
      .heat = 0.5 * hot, .vapour = 0.5 * steam, .droplets = 1e-2, .air = 0.5 * air};
  EXPECT_NEAR(mixture.density() - mixture.lack(mixed), 0.5 * steam + 0.5 * air + 1e-2, 1e-12);
}

TEST(GasMixture, SaturatesAsWaterBoilsAtOneAtmosphere) {
  GasMixture mixture;
  // Tables of steam: 44.0 g/m3 at 37 C; at 100 C one atmosphere, as an ideal gas 588 g/m3.
  EXPECT_NEAR(mixture.saturation(310.15), 44.0e-3, 0.2e-3);
  EXPECT_NEAR(mixture.saturation(kBoiling), 588e-3, 3e-3);
  mixture.humidity = 0.5;
  EXPECT_NEAR(mixture.resting_vapour(), 22.0e-3, 0.1e-3);
}

TEST(GasMixture, SteamTakesUpItsVolumeAndBringsItsHeat) {
  const GasMixture mixture;
  const GasGift steam = GasGift::steam(mixture, 1e-6, kBoiling);
  EXPECT_NEAR(steam.volume, 1e-6 / density_of(mixture, gas::kWaterMolarMass, kBoiling), 1e-15);
  // What it fills, it fills alone: no carbon dioxide is left there.
  const GasContent filled{.heat = steam.heat / steam.volume, .vapour = steam.vapour / steam.volume};
  EXPECT_NEAR(mixture.density() - mixture.lack(filled), 1e-6 / steam.volume, 1e-12);
  const GasGift fumes = GasGift::fumes(mixture, 1e-6, 800.0);
  EXPECT_NEAR(fumes.volume, 1e-6 / density_of(mixture, gas::kMolarMass, 800.0), 1e-15);
  // 20 W of boiling water make some 15 mL of steam a second.
  EXPECT_NEAR(GasGift::steam(mixture, 20.0 / 2.26e6, kBoiling).volume, 14.8e-6, 0.2e-6);
}

TEST(GasMixture, VapourOverSaturationCondensesUntilWhatIsLeftSaturatesTheWarmedGas) {
  const GasMixture mixture;
  const GasContent wet{.vapour = 60e-3};
  const double condensed = mixture.condenses(wet, 10.0);
  EXPECT_GT(condensed, 1e-3);
  EXPECT_LT(condensed, 60e-3 - mixture.saturation(mixture.temperature)) << "it warms the gas";
  const double kelvin = mixture.temperature + mixture.excess_of(gas::kLatentHeat * condensed);
  EXPECT_NEAR(60e-3 - condensed, mixture.saturation(kelvin), 1e-6);
  EXPECT_EQ(mixture.condenses({.vapour = 43e-3}, 10.0), 0.0) << "not over saturation";
}

TEST(GasMixture, DropletsInDryGasEvaporateWithinMillisecondsAndCoolIt) {
  const GasMixture mixture;
  const GasContent fog{.droplets = 1e-3};
  EXPECT_NEAR(mixture.condenses(fog, 1.0), -1e-3, 1e-9);
  // 1 g/m3 on 1e5 nuclei a cubic centimetre are droplets of 2.7 um, and 2 pi N d D / hindered is
  // 4.2 a second: without heat to evaporate by, it would be 34.
  const double soon = -mixture.condenses(fog, 1e-5) / 1e-5;
  const double diameter = std::cbrt(6.0 * 1e-3 / (M_PI * gas::kWaterDensity * mixture.nuclei));
  const double slope = (mixture.saturation(310.65) - mixture.saturation(309.65)) / 1.0;
  const double hindered =
      1.0 + gas::kLatentHeat * slope / (mixture.heat_capacity() * mixture.lewis());
  EXPECT_GT(hindered, 4.0);
  const double rate = 2.0 * M_PI * mixture.nuclei * diameter * mixture.vapour_diffusivity();
  EXPECT_NEAR(soon, rate / hindered * mixture.saturation(mixture.temperature), 0.02 * soon);
  EXPECT_LT(-mixture.condenses(fog, 1.0) + mixture.condenses(fog, 20e-3), 0.1e-3);
}

TEST(GasMixture, InHumidGasDropletsLast) {
  GasMixture humid;
  humid.humidity = 0.98;
  const GasContent fog{.droplets = 2e-3};
  const double evaporated = -humid.condenses(fog, 10.0);
  EXPECT_GT(evaporated, 0.0);
  EXPECT_LT(evaporated, 1e-3);
  humid.humidity = 1.0;
  EXPECT_NEAR(humid.condenses(fog, 10.0), 0.0, 1e-9);
}

TEST(GasMixture, CondensingMakesRoomByHeatAndTakesItByMoles) {
  const GasMixture mixture;
  const double swelling = mixture.swelling(1e-3);
  EXPECT_NEAR(
      swelling,
      1e-3 * (gas::kLatentHeat / mixture.full_heat() - mixture.volume_of(gas::kWaterMolarMass)),
      1e-15);
  EXPECT_GT(swelling, 0.0) << "latent heat swells the gas by more than the vapour had taken up";
}

}  // namespace
}  // namespace viscera
