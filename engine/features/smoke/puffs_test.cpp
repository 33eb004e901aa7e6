#include "engine/features/smoke/puffs.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "tests/kernels/heat/heated_liver.h"

namespace viscera::test {
namespace {

/// A steady burn of that power that has come to boil.
Bioheat boiling(double power) {
  BioheatOptions options;
  options.voxel = 0.25e-3;
  Bioheat heat(ThermalTissue{}, options, half_space());
  burn(heat, power, 0.5);
  return heat;
}

TEST(Puffs, CarryAllThatVaporisesAndItsHeat) {
  const Bioheat heat = boiling(20.0);
  const GasMixture mixture;
  double water = 0.0, lost = 0.0, smoke = 0.0, steam_heat = 0.0;
  for (const Vapour& vapour : heat.vapour()) {
    const double gas = 1.0 - heat.smoke(vapour) / (vapour.water + vapour.tissue);
    water += gas * vapour.water;
    lost += vapour.water + vapour.tissue;
    smoke += heat.smoke(vapour);
    steam_heat += gas * (vapour.water / gas::kWaterMolarMass + vapour.tissue / gas::kMolarMass) *
                  gas::kMolarHeat * (vapour.temperature - mixture.temperature);
  }
  ASSERT_GT(lost, 0.0);
  double puff_water = 0.0, puff_lost = 0.0, puff_smoke = 0.0, puff_heat = 0.0;
  std::size_t voxels = 0;
  for (const Puff& puff : puffs_of(heat, mixture)) {
    EXPECT_LT(std::abs(puff.place.x() - 0.4e-3), 3e-3);
    EXPECT_GE(puff.temperature, 373.0);
    puff_water += puff.gas.vapour;
    puff_lost += puff.mass + puff.smoke;
    puff_smoke += puff.smoke;
    puff_heat += puff.gas.heat;
    voxels += puff.voxels.size();
  }
  EXPECT_NEAR(puff_water, water, 1e-9 * water);
  EXPECT_NEAR(puff_lost, lost, 1e-9 * lost);
  EXPECT_NEAR(puff_smoke, smoke, 1e-9 * smoke);
  EXPECT_NEAR(puff_heat, steam_heat, 1e-9 * steam_heat);
  EXPECT_EQ(voxels, heat.vapour().size());
}

TEST(Puffs, SteamOfASpotLeavesAtMetresASecondAndFasterWhereMoreBoils) {
  const GasMixture mixture;
  const auto speed = [&](double power) {
    const Bioheat heat = boiling(power);
    double volume = 0.0;
    std::vector<Vec3> voxels;
    for (const Puff& puff : puffs_of(heat, mixture)) {
      volume += puff.gas.volume;
      voxels.insert(voxels.end(), puff.voxels.begin(), puff.voxels.end());
    }
    return vent_speed(volume, area_over(voxels, Vec3::UnitZ(), heat.options().voxel), kPictureTime);
  };
  const double slow = speed(8.0), fast = speed(20.0);
  EXPECT_GT(slow, 0.5);
  EXPECT_LT(fast, 50.0);
  EXPECT_GT(fast, 1.2 * slow);
}

TEST(Puffs, TwentyWattsThatAllBoilMakeThirteenMillilitresOfSteamASecond) {
  const GasMixture mixture;
  const double mass = 20.0 / 2.26e6;  // in a second, as latent heat alone
  EXPECT_NEAR(GasGift::steam(mixture, mass, 373.15).volume, 15e-6, 0.5e-6);
  EXPECT_NEAR(mass * mixture.volume_of(gas::kWaterMolarMass), 12.3e-6, 0.5e-6);  // at 37 C
  // Through a spot of 1.5 mm.
  EXPECT_NEAR(vent_speed(15e-6, M_PI * 0.75e-3 * 0.75e-3, 1.0), 8.5, 0.1);
}

TEST(Puffs, TheAreaOverVoxelsIsThatOfTheirColumns) {
  constexpr double kEdge = 0.25e-3;
  std::vector<Vec3> voxels;
  for (int i = 0; i < 4; ++i)
    for (int j = 0; j < 3; ++j)
      for (int k = 0; k < 5; ++k) voxels.emplace_back(kEdge * i, kEdge * j, kEdge * k);
  EXPECT_NEAR(area_over(voxels, Vec3::UnitZ(), kEdge), 12.0 * kEdge * kEdge, 1e-12);
  EXPECT_NEAR(area_over(voxels, Vec3::UnitX(), kEdge), 15.0 * kEdge * kEdge, 1e-12);
  EXPECT_EQ(area_over({}, Vec3::UnitZ(), kEdge), 0.0);
}

TEST(Puffs, NothingLeavesFasterThanSoundOrThroughNothing) {
  EXPECT_LT(vent_speed(1.0, 1e-6, 1e-3), 500.0);
  EXPECT_EQ(vent_speed(1e-6, 0.0, 1e-3), 0.0);
  EXPECT_EQ(vent_speed(1e-6, 1e-6, 0.0), 0.0);
  EXPECT_TRUE(puffs_of(Bioheat(ThermalTissue{}, {}), GasMixture()).empty());
}

}  // namespace
}  // namespace viscera::test
