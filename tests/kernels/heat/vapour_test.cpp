// Boiling, drying and charring.
#include <gtest/gtest.h>

#include <cmath>

#include "engine/verification/heat_solutions.h"

namespace viscera {
namespace {

constexpr double kFrame = 1.0 / 60.0;
// Of liver, worked out apart from the program.
constexpr double kWet = 1079.0 * 3540.0;                    // heat capacity [J/(m3 K)]
constexpr double kDry = 1079.0 * (3540.0 - 0.72 * 4180.0);  // of what water leaves
constexpr double kWater = 1079.0 * 0.72;                    // [kg/m3]
constexpr double kSolids = 1079.0 * 0.28;                   // [kg/m3]
constexpr double kLatent = 2.26e6;                          // [J/kg]

// A brick that is alone: no gas, nothing beside it.
SignedDistance lone_brick() {
  return [](const Vec3& p) { return (p - Vec3::Constant(2e-3)).cwiseAbs().maxCoeff() - 2e-3; };
}

BioheatOptions insulated() {
  BioheatOptions options;
  options.cooling.coefficient = 0.0;
  return options;
}

TEST(Vapour, WaterKeepsTissueAtAHundredDegreesUntilItHasGone) {
  const ThermalTissue tissue = plain_tissue();
  Bioheat heat(tissue, insulated(), lone_brick());
  heat.bricks().warm_up({0, 0, 0});
  const double volume = tissue_volume(heat), whole = kWater * volume;
  const double to_boiling = 63.0 * kWet * volume;
  const double to_dry = to_boiling + whole * kLatent;
  const double power = 30.0;
  double energy = 0.0;
  while (energy < 1.2 * to_dry) {
    heat_evenly(heat, power * kFrame, kFrame);
    heat.step(kFrame);
    energy += power * kFrame;
    const double excess = heat.bricks().excess_at({3, 4, 5});
    const double left = heat.bricks().water_at({3, 4, 5});
    if (energy < to_boiling) {
      EXPECT_NEAR(excess, energy / to_boiling * 63.0, 1e-3);
      EXPECT_EQ(left, 1.0);
    } else if (energy < to_dry) {
      EXPECT_NEAR(excess, 63.0, 1e-4);
      EXPECT_NEAR(left, 1.0 - (energy - to_boiling) / (to_dry - to_boiling), 1e-3);
    }
  }
  EXPECT_EQ(heat.bricks().water_at({3, 4, 5}), 0.0);
  EXPECT_NEAR(heat.bricks().excess_at({3, 4, 5}), 63.0 + (energy - to_dry) / (kDry * volume), 0.5);
  EXPECT_NEAR(heat.vaporised_water(), whole, 1e-4 * whole);
  EXPECT_NEAR(heat.book().latent, whole * kLatent, 1e-4 * whole * kLatent);
}

TEST(Vapour, SaysWhereItComesFromAndHowHotItIs) {
  Bioheat heat(plain_tissue(), insulated());
  HeatBrick* brick = heat.bricks().warm_up({0, 0, 0});
  const int voxel = 3 + 8 * (4 + 8 * 5);
  brick->warm->excess[voxel] = 62.9f;
  heat.heat_voxel(*brick, voxel, 3.0);
  heat.step(kFrame);
  ASSERT_EQ(heat.vapour().size(), 1u);
  const Vapour& vapour = heat.vapour()[0];
  EXPECT_NEAR((vapour.position - heat.bricks().centre(*brick, voxel)).norm(), 0.0, 1e-9);
  EXPECT_NEAR(vapour.temperature, 373.15, 1e-3);
  // 3 W for a frame, less what takes a voxel of half a millimetre from 62.9 K to 63 K; some 3 %
  // goes to its neighbours.
  const double water = (3.0 * kFrame - 0.1 * kWet * 0.125e-9) / kLatent;
  EXPECT_LT(vapour.water, water);
  EXPECT_GT(vapour.water, 0.95 * water);
  EXPECT_EQ(vapour.tissue, 0.0);
  EXPECT_NEAR(heat.smoke(vapour), 0.05 * vapour.water, 1e-18);
  heat.step(kFrame);
  EXPECT_TRUE(heat.vapour().empty());
}

TEST(Vapour, DryTissueCharsWhereItIsHotAndLeavesItsShare) {
  ThermalTissue tissue = plain_tissue();
  tissue.pyrolysis = ThermalTissue{}.pyrolysis;
  const auto charred_after = [&](double celsius, double seconds) {
    Bioheat heat(tissue, insulated(), lone_brick());
    HeatBrick* brick = heat.bricks().warm_up({0, 0, 0});
    brick->water.fill(0.0f);
    for (int step = 0; step < std::lround(seconds / kFrame); ++step) {
      brick->warm->excess.fill(static_cast<float>(celsius - 37.0));
      heat.step(kFrame);
    }
    const double solids = kSolids * tissue_volume(heat);
    EXPECT_NEAR(heat.vaporised_tissue(), solids * 0.75 * heat.bricks().charred_at({1, 2, 3}),
                1e-4 * solids);
    return heat.bricks().charred_at({1, 2, 3});
  };
  EXPECT_LT(charred_after(150.0, 2.0), 0.02);
  EXPECT_NEAR(charred_after(250.0, 1.0), 1.0 - std::exp(-0.7073),
              0.02);  // 6.8e10 exp(-1.1e5 / R T)
  EXPECT_GT(charred_after(350.0, 1.0), 0.99);
}

TEST(Vapour, WetTissueDoesntChar) {
  ThermalTissue tissue = plain_tissue();
  tissue.pyrolysis = ThermalTissue{}.pyrolysis;
  Bioheat heat(tissue, insulated(), lone_brick());
  heat.bricks().warm_up({0, 0, 0});
  for (int step = 0; step < 120; ++step) {
    heat_evenly(heat, 30.0 * kFrame, kFrame);
    heat.step(kFrame);
  }
  EXPECT_GT(heat.vaporised_water(), 0.0);
  EXPECT_EQ(heat.bricks().charred_at({1, 1, 1}), 0.0);
  EXPECT_EQ(heat.vaporised_tissue(), 0.0);
}

}  // namespace
}  // namespace viscera
