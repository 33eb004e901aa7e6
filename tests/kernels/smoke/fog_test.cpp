#include "kernels/smoke/fog.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "kernels/smoke/droplet_optics.h"

namespace viscera {
namespace {

constexpr double kWavelength = 0.55e-6;

TEST(FogOptics, OfItsTableAreThoseOfDropletsOfThatSize) {
  const GasMixture mixture;
  const FogOptics optics(mixture, kWavelength);
  // Between the entries, too, as far as Mie's ripples let it.
  for (const double load : {1.3e-6, 4e-5, 7e-4, 2.2e-2}) {
    const SmokeOptics exact = optics_of({.median = mixture.droplet_diameter(load),
                                         .deviation = 1.2,
                                         .density = gas::kWaterDensity,
                                         .refraction = 1.333,
                                         .absorption = 0.0},
                                        kWavelength);
    EXPECT_NEAR(optics.extinction(load), exact.mass_extinction * load,
                0.02 * exact.mass_extinction * load)
        << load;
    EXPECT_NEAR(optics.asymmetry(load), exact.asymmetry, 0.02) << load;
  }
}

TEST(FogOptics, OfLargeDropletsAreTwiceTheirShadow) {
  const GasMixture mixture;
  const FogOptics optics(mixture, kWavelength);
  const double load = 0.05, d = mixture.droplet_diameter(load);
  const double shadow = mixture.nuclei * std::numbers::pi * d * d / 4.0;  // [1/m]
  EXPECT_NEAR(optics.extinction(load), 2.0 * shadow, 0.2 * shadow);
  EXPECT_EQ(optics.extinction(0.0), 0.0);
  EXPECT_GT(optics.extinction(1e-9), 0.0);
}

GasParameters room(double humidity) {
  GasParameters parameters;
  parameters.domain = Box(Vec3(-0.03, -0.03, 0.0), Vec3(0.03, 0.03, 0.06));
  parameters.cells = 12;
  parameters.mixture.humidity = humidity;
  return parameters;
}

GasSource steam(const GasMixture& mixture, double mass) {
  GasSource source;
  source.position = Vec3(0.0, 0.0, 0.02);
  source.radius = 2e-3;
  source.gift = GasGift::steam(mixture, mass, 373.15);
  return source;
}

/// Of light, over the whole grid [m2].
double cross_section(const SmokeGrid& fog, double mass_extinction) {
  double sum = 0.0;
  for (const float density : fog.density) sum += static_cast<double>(density);
  return sum * std::pow(fog.voxel, 3) * mass_extinction;
}

TEST(Fog, OfSteamIsSeenWhileItLastsAndGoneInDryGasWithinASecond) {
  GasGrid gas(room(0.0));
  const GasMixture& mixture = gas.parameters().mixture;
  const FogOptics optics(mixture, kWavelength);
  double asymmetry = 0.0;
  EXPECT_TRUE(fog_of(gas, optics, 5000.0, asymmetry).density.empty());
  double most = 0.0;
  for (int frame = 0; frame < 12; ++frame) {
    gas.give(steam(mixture, 5e-6 / 60.0));  // what 12 W boil
    gas.step(1.0 / 60.0);
    most = std::max(most, cross_section(fog_of(gas, optics, 5000.0, asymmetry), 5000.0));
  }
  EXPECT_GT(most, 1e-6);
  EXPECT_GT(asymmetry, 0.6);
  EXPECT_LT(asymmetry, 0.95);
  for (int frame = 0; frame < 60; ++frame) gas.step(1.0 / 60.0);
  EXPECT_LT(cross_section(fog_of(gas, optics, 5000.0, asymmetry), 5000.0), 0.01 * most);
}

TEST(Fog, ItsGridTakesAsMuchLightAsTheDropletsOfTheCells) {
  GasGrid gas(room(1.0));
  const GasMixture& mixture = gas.parameters().mixture;
  const FogOptics optics(mixture, kWavelength);
  for (int frame = 0; frame < 20; ++frame) {
    gas.give(steam(mixture, 5e-6 / 60.0));
    gas.step(1.0 / 60.0);
  }
  double expected = 0.0;
  for (int k = 0; k < gas.cells()[2]; ++k)
    for (int j = 0; j < gas.cells()[1]; ++j)
      for (int i = 0; i < gas.cells()[0]; ++i)
        expected += optics.extinction(gas.content(i, j, k).droplets) * gas.spacing().prod();
  ASSERT_GT(expected, 0.0);
  double asymmetry = 0.0;
  const SmokeGrid fog = fog_of(gas, optics, 5000.0, asymmetry);
  EXPECT_NEAR(cross_section(fog, 5000.0), expected, 0.02 * expected);
  // Another mass extinction is another density, and the same light.
  const SmokeGrid other = fog_of(gas, optics, 1000.0, asymmetry);
  EXPECT_NEAR(cross_section(other, 1000.0), expected, 0.02 * expected);
}

}  // namespace
}  // namespace viscera
