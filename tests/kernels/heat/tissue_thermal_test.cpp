#include "kernels/heat/tissue_thermal.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace viscera {
namespace {

constexpr double kBody = 310.15;

TEST(ThermalTissue, WetTissueHasItsOwnHeatCapacityAndDryTissueItsSolidsAlone) {
  const ThermalTissue liver;
  EXPECT_NEAR(heat_capacity(liver, 1.0), liver.density * liver.specific_heat, 1e-6);
  EXPECT_NEAR(heat_capacity(liver, 0.0),
              liver.density * (1.0 - liver.water_fraction) * solids_specific_heat(liver), 1e-6);
  EXPECT_NEAR(heat_capacity(liver, 0.0, 1.0), liver.char_share * heat_capacity(liver, 0.0), 1e-6);
}

TEST(ThermalTissue, CurrentFlowsMoreEasilyInWarmTissueAndHardlyInDry) {
  const ThermalTissue liver;
  EXPECT_NEAR(electric_conductivity(liver, 1.0, kBody), 0.148, 1e-12);
  EXPECT_NEAR(electric_conductivity(liver, 1.0, kBody + 10.0), 0.148 * 1.18, 1e-12);
  EXPECT_EQ(electric_conductivity(liver, 1.0, 360.0), electric_conductivity(liver, 1.0, 373.15));
  EXPECT_NEAR(electric_conductivity(liver, 0.0, kBody), 0.148 * 0.01, 1e-12);
  EXPECT_LT(electric_conductivity(liver, 0.5, 373.15),
            0.3 * electric_conductivity(liver, 1.0, 373.15));
}

TEST(ThermalTissue, HeatFlowsBetterInWarmTissueAndWorseInDry) {
  const ThermalTissue liver;
  EXPECT_NEAR(heat_conductivity(liver, 1.0, 0.0, kBody), 0.52, 1e-12);
  EXPECT_NEAR(heat_conductivity(liver, 0.0, 0.0, kBody), 0.15, 1e-12);
  EXPECT_GT(heat_conductivity(liver, 1.0, 50.0, kBody), 0.52);
  EXPECT_EQ(heat_conductivity(liver, 1.0, 300.0, kBody),
            heat_conductivity(liver, 1.0, 63.0, kBody));
}

TEST(ThermalTissue, VapourIsAsDenseAsInSteamTables) {
  // 0.0436 kg/m3 at 37 C and 0.598 at 100 C [R].
  EXPECT_NEAR(water::vapour_density(kBody), 0.0436, 0.001);
  EXPECT_NEAR(water::vapour_density(373.15), 0.598, 0.01);
  EXPECT_EQ(water::vapour_density(500.0), water::vapour_density(373.15));
}

TEST(ThermalTissue, PerfusionOfTablesBecomesARate) {
  EXPECT_NEAR(perfusion_rate(860.0, 1079.0), ThermalTissue{}.perfusion, 1e-5);
}

TEST(ThermalTissue, ImpossibleValuesAreNamedAllAtOnce) {
  EXPECT_TRUE(check(ThermalTissue{}));
  ThermalTissue bad;
  bad.density = -1.0;
  bad.conductivity = std::numeric_limits<double>::quiet_NaN();
  const auto result = check(bad);
  ASSERT_FALSE(result);
  ASSERT_EQ(result.error().messages.size(), 2u);
  EXPECT_NE(result.error().text().find("density"), std::string::npos);
  EXPECT_NE(result.error().text().find("thermal_conductivity"), std::string::npos);
}

TEST(ThermalTissue, WaterCantHoldMoreHeatThanTheWholeTissue) {
  ThermalTissue bad;
  bad.specific_heat = 2000.0;
  const auto result = check(bad);
  ASSERT_FALSE(result);
  EXPECT_NE(result.error().text().find("specific_heat"), std::string::npos);
}

}  // namespace
}  // namespace viscera
