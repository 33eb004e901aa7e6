// Current from an electrode: resistance, where it heats, sparks, and the metal's own warmth.
#include "kernels/heat/electrode.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "kernels/heat/current_field.h"
#include "kernels/heat/heat_room.h"

namespace viscera {
namespace {

constexpr double kFrame = 1.0 / 60.0;
constexpr double kPi = std::numbers::pi;

// Tissue below z = 0.
SignedDistance flat() {
  return [](const Vec3& p) { return p.z(); };
}

Bioheat liver(double voxel = 0.5e-3) {
  BioheatOptions options;
  options.voxel = voxel;
  return Bioheat(ThermalTissue{}, options, flat());
}

ElectrodeContact disc(double radius, const Vec3& at = Vec3::Zero()) {
  ElectrodeContact contact;
  contact.point = at;
  contact.area = kPi * radius * radius;
  return contact;
}

double source_power(const Bioheat& heat) {
  double power = 0.0;
  for (std::size_t b = 0; b < heat.bricks().count(); ++b)
    for (const float q : heat.bricks().brick(b).warm->source) power += q * heat.voxel_volume();
  return power;
}

TEST(Electrode, ResistanceOfADiscOnUniformTissueIsNewmans) {
  const double radius = 1e-3;
  const double exact = 1.0 / (4.0 * ThermalTissue{}.electric_conductivity * radius);
  double last = 1.0;
  for (const double voxel : {1e-3, 0.5e-3, 0.25e-3}) {
    Bioheat heat = liver(voxel);
    CurrentField field(heat, Vec3::Zero(), Vec3::UnitZ(), radius, 0.0, kFrame);
    const double error = std::abs((field.near_resistance() + field.far_resistance()) / exact - 1.0);
    EXPECT_LT(error, 0.05) << voxel;
    last = error;
  }
  EXPECT_LT(last, 0.02);
}

TEST(Electrode, ResistanceHardlyDependsOnWhereTheVoxelsAre) {
  const double radius = 0.8e-3;
  const double exact = 1.0 / (4.0 * ThermalTissue{}.electric_conductivity * radius);
  for (const double shift : {0.0, 0.1e-3, 0.2e-3, 0.3e-3, 0.4e-3}) {
    Bioheat heat = liver();
    CurrentField field(heat, Vec3(shift, 0.5 * shift, 0.0), Vec3::UnitZ(), radius, 0.0, kFrame);
    EXPECT_NEAR(field.near_resistance() + field.far_resistance(), exact, 0.06 * exact) << shift;
  }
}

TEST(Electrode, HeatsAFewRadiiAwayAsAPointsCurrentDoes) {
  Bioheat heat = liver(0.25e-3);
  const double radius = 0.5e-3, sigma = heat.tissue().electric_conductivity;
  CurrentField field(heat, Vec3::Zero(), Vec3::UnitZ(), radius, 0.0, kFrame);
  const double current = 0.05;
  field.heat_with(heat, current, kFrame);
  for (const double away : {2.125e-3, 2.625e-3}) {
    const BrickIndex voxel = heat.bricks().voxel_of(Vec3(0.01e-3, 0.01e-3, -away));
    const BrickIndex index = BrickField::brick_of(voxel), local = voxel - index * 8;
    const double q =
        heat.bricks().find(index)->warm->source[local.x() + 8 * (local.y() + 8 * local.z())];
    const double density = current / (2.0 * kPi * away * away);
    // A disc's field nears the point's as the square of radius over distance.
    EXPECT_NEAR(q, density * density / sigma, 0.12 * density * density / sigma) << away;
  }
}

TEST(Electrode, AllPowerIsAccountedFor) {
  Bioheat heat = liver();
  ElectrodeTip tip;
  const CurrentReport report =
      tip.energise(heat, CurrentMode::kBlend, 25.0, disc(1e-3), disc(1e-3), kFrame);
  EXPECT_NEAR(report.generated(), 25.0, 1e-6);
  EXPECT_NEAR(source_power(heat), report.power, 1e-4 * report.power);
  EXPECT_GT(report.power, 0.8 * 25.0);
  EXPECT_EQ(report.spark_power + report.metal_power, 0.0);
  EXPECT_NEAR(report.current * report.voltage, 25.0, 1e-6);
  EXPECT_NEAR(report.voltage / report.current, report.resistance, 1e-6 * report.resistance);
  EXPECT_EQ(report.by_current + report.by_voltage, 0.0);
  EXPECT_FALSE(report.open || report.sparks || report.refused);
  heat.step(kFrame);
  EXPECT_NEAR(heat.book().delivered, report.power * kFrame, 1e-4 * report.power * kFrame);
}

TEST(Electrode, TheBurnIsRound) {
  Bioheat heat = liver();
  ElectrodeTip tip;
  for (int step = 0; step < 60; ++step) {
    tip.energise(heat, CurrentMode::kCoagulate, 15.0, disc(1e-3), disc(1e-3), kFrame);
    heat.step(kFrame);
  }
  for (const int r : {1, 3, 5}) {
    const double east = heat.bricks().excess_at({r, 0, -1});
    for (const BrickIndex& other :
         {BrickIndex(-1 - r, 0, -1), BrickIndex(0, r, -1), BrickIndex(0, -1 - r, -1)})
      EXPECT_NEAR(heat.bricks().excess_at(other), east, 0.01 * east + 0.01);
  }
  EXPECT_GT(heat.bricks().excess_at({1, 0, -1}), heat.bricks().excess_at({5, 0, -1}));
}

TEST(Electrode, CurrentFallsAsTissueDries) {
  Bioheat heat = liver();
  ElectrodeTip tip;
  CurrentReport first, last;
  double least = 1e9;
  for (int step = 0; step < 600; ++step) {
    last = tip.energise(heat, CurrentMode::kCut, 30.0, disc(0.6e-3), disc(0.6e-3), kFrame);
    if (step == 0) first = last;
    least = std::min(least, last.resistance);
    heat.step(kFrame);
  }
  // Warm tissue conducts better at first; dry tissue hardly does.
  EXPECT_LT(least, 0.85 * first.resistance);
  EXPECT_GT(last.resistance, 1.5 * least);
  EXPECT_LT(last.power, 0.8 * first.power);
  EXPECT_LT(heat.bricks().water_at({0, 0, -1}), 0.05);
  EXPECT_LT(heat.greatest_excess() + heat.options().body, 1500.0);
}

TEST(Electrode, SparksCrossADriedLayerThatIsThinEnough) {
  Bioheat heat = liver(0.25e-3);
  for (const int x : {-1, 0})
    for (const int y : {-1, 0})
      if (HeatBrick* brick = heat.bricks().warm_up({x, y, -1}))
        for (int i = 0; i < 64; ++i) brick->water[i + 64 * 7] = 0.0f;
  const double radius = 1e-3;
  CurrentField sealed(heat, Vec3::Zero(), Vec3::UnitZ(), radius, 0.0, kFrame);
  CurrentField short_gap(heat, Vec3::Zero(), Vec3::UnitZ(), radius, 0.1e-3, kFrame);
  CurrentField long_gap(heat, Vec3::Zero(), Vec3::UnitZ(), radius, 1e-3, kFrame);
  EXPECT_EQ(short_gap.near_resistance(), sealed.near_resistance());
  EXPECT_LT(long_gap.near_resistance(), 0.5 * sealed.near_resistance());
  const double current = 0.01;
  const CurrentField::Heating given = long_gap.heat_with(heat, current, kFrame);
  EXPECT_LT(given.gas, 1e-9) << "they heat the layer that they cross";
  const double dry = heat.bricks().find({0, 0, -1})->warm->source[64 * 7];
  const double wet = heat.bricks().find({0, 0, -1})->warm->source[64 * 6];
  EXPECT_GT(dry, 0.2 * wet) << "a hundredth of the wet tissue's conductivity would take far less";
  EXPECT_NEAR(given.gas + given.tissue, current * current * long_gap.near_resistance() * kFrame,
              1e-7);
}

// A half-space that is burnt for so long; what a generator was asked for, what it gave, and what
// came of it.
struct Burn {
  double generated = 0.0, delivered = 0.0, greatest = 0.0, residual = 0.0, water = 0.0;
};
Burn burn_for(double seconds, double dt, double power, double radius, CurrentMode mode,
              double voxel) {
  Bioheat heat = liver(voxel);
  ElectrodeTip tip;
  Burn burn;
  for (int step = 0; step < std::lround(seconds / dt); ++step) {
    const CurrentReport report = tip.energise(heat, mode, power, disc(radius), disc(radius), dt);
    burn.generated += report.generated() * dt;
    EXPECT_LE(report.generated(), power * (1.0 + 1e-9));
    heat.step(dt);
  }
  burn.delivered = heat.book().delivered;
  burn.greatest = heat.options().body + heat.greatest_excess();
  burn.residual = heat.book().residual();
  burn.water = heat.vaporised_water();
  return burn;
}

TEST(Electrode, NoPowerAndNoStepMakeTissueHotterThanCharCanBe) {
  for (const CurrentMode mode : {CurrentMode::kCut, CurrentMode::kFulgurate}) {
    for (const double power : {1.0, 30.0, 120.0, 500.0}) {
      for (const double radius : {0.2e-3, 0.8e-3}) {
        for (const double dt : {1.0 / 240.0, 1.0 / 60.0, 0.1}) {
          const Burn burn = burn_for(0.3, dt, power, radius, mode, 0.5e-3);
          const auto what = testing::Message() << power << " W, " << radius << " m, " << dt << " s";
          EXPECT_LT(burn.greatest, kHottest + 1.0) << what;
          EXPECT_LT(std::abs(burn.residual), 1e-4 * burn.delivered) << what;
          EXPECT_LE(burn.delivered, burn.generated * (1.0 + 1e-6)) << what;
        }
      }
    }
  }
}

TEST(Electrode, FineVoxelsThatDryWithinAFrameStayPhysicalToo) {
  const Burn burn = burn_for(0.1, kFrame, 120.0, 0.3e-3, CurrentMode::kCoagulate, 0.2e-3);
  EXPECT_GT(burn.greatest, 373.15);
  EXPECT_LT(burn.greatest, kHottest + 1.0);
  EXPECT_LT(std::abs(burn.residual), 1e-4 * burn.delivered);
}

TEST(Electrode, WhatDriesWithinAStepNoLongerTakesWhatItDidWet) {
  // So much that the voxels under the disc dry within the first frame.
  const auto burn = [](double dt) {
    return burn_for(0.05, dt, 150.0, 0.5e-3, CurrentMode::kCut, 0.5e-3);
  };
  const Burn whole = burn(kFrame), parts = burn(kFrame / 16.0);
  // What heat's spreading wets and warms within the frame the field doesn't follow.
  EXPECT_NEAR(whole.generated, parts.generated, 0.12 * parts.generated);
  EXPECT_NEAR(whole.delivered, parts.delivered, 0.12 * parts.delivered);
  EXPECT_NEAR(whole.water, parts.water, 0.12 * parts.water);
  EXPECT_LT(parts.generated, 0.9 * 150.0 * 0.05);
}

TEST(Electrode, DriedOutTissueIsHardlyGivenPower) {
  Bioheat heat = liver();
  const double radius = 0.8e-3;
  const auto power = [&] {
    ElectrodeTip tip;
    return tip.energise(heat, CurrentMode::kCut, 60.0, disc(radius), disc(radius), 1e-4);
  };
  EXPECT_GT(power().power, 50.0);
  // The source of that is spread before all that conducts is dried.
  heat.step(1e-4);
  for (std::size_t b = 0; b < heat.bricks().count(); ++b) heat.bricks().brick(b).water.fill(0.0f);
  const CurrentReport dry = power();
  EXPECT_EQ(dry.by_voltage, 1.0);
  EXPECT_LT(dry.power, 10.0);
  EXPECT_LT(dry.generated(), 10.0);
}

TEST(Electrode, CurrentGoesRoundWhatIsDry) {
  Bioheat heat = liver();
  for (int z = -1; z <= -1; ++z)
    for (int y = -1; y <= 0; ++y)
      if (HeatBrick* brick = heat.bricks().warm_up({0, y, z})) brick->water.fill(0.0f);
  CurrentField field(heat, Vec3::Zero(), Vec3::UnitZ(), 1e-3, 0.0, kFrame);
  field.heat_with(heat, 0.1, kFrame);
  const auto q = [&](const BrickIndex& brick, int voxel) {
    return heat.bricks().find(brick)->warm->source[voxel];
  };
  const int right = 3 + 8 * (0 + 8 * 6), left = 4 + 8 * (0 + 8 * 6);
  EXPECT_GT(q({-1, 0, -1}, left), 20.0f * q({0, 0, -1}, right));
  EXPECT_GT(q({0, 0, -1}, right), 0.0f);
}

TEST(Electrode, TheGeneratorsVoltageLimitsPoorContacts) {
  ThermalTissue fat;
  fat.electric_conductivity = 0.01;
  Bioheat heat(fat, BioheatOptions{}, flat());
  ElectrodeTip tip;
  const CurrentReport report =
      tip.energise(heat, CurrentMode::kCut, 100.0, disc(0.4e-3), disc(0.4e-3), kFrame);
  EXPECT_EQ(report.by_voltage, 1.0);
  EXPECT_LT(report.power, 20.0);
  EXPECT_NEAR(report.voltage, waveform_of(CurrentMode::kCut).greatest_voltage(), 1.0);
}

TEST(Electrode, SparksReachFurtherTheHigherTheVoltage) {
  const Electrode electrode;
  ElectrodeContact near;
  near.depth = -0.2e-3;
  ElectrodeContact far;
  far.depth = -1.0e-3;
  const double cut = waveform_of(CurrentMode::kCut).peak_voltage;
  const double coagulate = waveform_of(CurrentMode::kFulgurate).peak_voltage;
  EXPECT_GT(contact_radius(electrode, near, cut), 0.0);
  EXPECT_EQ(contact_radius(electrode, far, cut), 0.0);
  EXPECT_GT(contact_radius(electrode, far, coagulate), 0.0);
  EXPECT_EQ(spark_gap(100.0), 0.0);

  Bioheat heat = liver();
  ElectrodeTip tip;
  const CurrentReport spark = tip.energise(heat, CurrentMode::kFulgurate, 30.0, far, far, kFrame);
  EXPECT_TRUE(spark.sparks);
  EXPECT_NEAR(spark.generated(), 30.0, 1e-6);
}

/// A millimetre from the surface.
ElectrodeContact gap() {
  ElectrodeContact contact;
  contact.depth = -1.0e-3;
  return contact;
}

TEST(Electrode, ASparkWarmsTissueMetalAndGasByItsFallsAndItsColumn) {
  Bioheat heat = liver();
  ElectrodeTip tip;
  const CurrentReport report =
      tip.energise(heat, CurrentMode::kFulgurate, 30.0, gap(), gap(), 1e-3);
  const SparkDrop drop = spark_drop(1e-3);
  const double mean = report.current * waveform_of(CurrentMode::kFulgurate).mean_share();
  EXPECT_NEAR(report.spark_power, drop.tissue * mean, 1e-6);
  EXPECT_NEAR(report.metal_power, drop.metal * mean, 1e-9);
  EXPECT_NEAR(report.gas_power, drop.column * mean, 1e-6);
  // Most of the power is the current's, in the tissue, even so.
  EXPECT_GT(report.power - report.spark_power, 0.6 * 30.0);
  EXPECT_NEAR(tip.excess(), report.metal_power * 1e-3 / tip.electrode().heat_capacity,
              1e-3 * tip.excess());
}

TEST(Electrode, SparksWarmTheSpotEvenlyWhereverTheVoxelsAre) {
  for (const double shift : {0.0, 0.17e-3, 0.4e-3}) {
    Bioheat heat(ThermalTissue{}, BioheatOptions{}, [=](const Vec3& p) { return p.z() - shift; });
    const Vec3 point(shift, 0.5 * shift, shift);
    CurrentField field(heat, point, Vec3::UnitZ(), 1.2e-3, 0.0, kFrame);
    const CurrentField::Heating given = field.heat_with(heat, 0.0, kFrame, 3.0);
    EXPECT_NEAR(given.tissue, 3.0 * kFrame, 1e-9);
    EXPECT_NEAR(given.sparks, given.tissue, 1e-12);
    double whole = 0.0, aside = 0.0, deep = 0.0, away = 0.0;
    for (std::size_t b = 0; b < heat.bricks().count(); ++b) {
      for (int i = 0; i < BrickField::kVoxels; ++i) {
        const double q = heat.bricks().brick(b).warm->source[i] * heat.voxel_volume();
        const Vec3 from = heat.bricks().centre(heat.bricks().brick(b), i) - point;
        whole += q;
        aside += q * from.x();
        deep += -q * from.z();
        away += q * from.head<2>().squaredNorm();
      }
    }
    EXPECT_NEAR(whole, 3.0, 1e-4);
    EXPECT_NEAR(aside / whole, 0.0, 0.05e-3) << "about the middle";
    EXPECT_NEAR(deep / whole, 0.25e-3, 0.13e-3) << "in the outermost layer";
    EXPECT_NEAR(away / whole, 0.5 * 1.2e-3 * 1.2e-3, 0.12 * 1.2e-3 * 1.2e-3) << "over the disc";
  }
}

TEST(Electrode, WhatCharCantTakeOfSparksGoesOffWithTheFumes) {
  Bioheat heat = liver();
  CurrentField field(heat, Vec3::Zero(), Vec3::UnitZ(), 0.6e-3, 0.0, 1.0);
  const CurrentField::Heating given = field.heat_with(heat, 0.0, 1.0, 400.0);
  EXPECT_GT(given.gas, 100.0);
  EXPECT_NEAR(given.tissue + given.gas, 400.0, 1e-6);
}

TEST(Electrode, TheBookClosesWithSparksOn) {
  Bioheat heat = liver();
  ElectrodeTip tip;
  double generated = 0.0, body = 0.0, metal = 0.0, gas = 0.0, sparks = 0.0;
  for (int step = 0; step < 90; ++step) {
    const CurrentReport report =
        tip.energise(heat, CurrentMode::kFulgurate, 60.0, gap(), gap(), kFrame);
    generated += report.generated() * kFrame;
    body += report.body_power * kFrame;
    metal += report.metal_power * kFrame;
    gas += report.gas_power * kFrame;
    sparks += report.spark_power * kFrame;
    EXPECT_LE(report.generated(), 60.0 * (1.0 + 1e-9));
    heat.step(kFrame);
  }
  const HeatBook book = heat.book();
  EXPECT_GT(generated, 30.0);
  for (const double part : {body, metal, gas, sparks}) EXPECT_GT(part, 1e-3 * generated);
  EXPECT_LT(sparks, book.delivered);
  EXPECT_NEAR(book.delivered + body + metal + gas, generated, 1e-5 * generated);
  EXPECT_LT(std::abs(book.residual()), 1e-4 * book.delivered);
  EXPECT_LT(heat.greatest_excess() + heat.options().body, kHottest + 1.0);
}

TEST(Electrode, AGlowingTipLosesWhatSparksGiveIt) {
  Bioheat heat = liver();
  ElectrodeTip tip;
  for (int step = 0; step < 1800; ++step) {
    // Over fresh tissue, so that the current lasts.
    ElectrodeContact over = gap();
    over.point.x() = 1e-3 * (step / 60);
    tip.energise(heat, CurrentMode::kFulgurate, 60.0, over, over, kFrame);
    heat.step(kFrame);
  }
  EXPECT_GT(tip.excess(), 300.0);
  EXPECT_LT(tip.excess() + 310.0, 1700.0) << "steel would melt";
}

TEST(Electrode, ThePowerThatIsSetGoesIntoTheBodyToo) {
  const auto power = [](double body) {
    Bioheat heat = liver();
    ElectrodeTip tip({}, {.body_resistance = body});
    const CurrentReport report =
        tip.energise(heat, CurrentMode::kBlend, 25.0, disc(2e-3), disc(2e-3), 1e-4);
    EXPECT_NEAR(report.generated(), 25.0, 1e-6);
    EXPECT_NEAR(report.current * report.current * report.resistance, 25.0, 1e-6);
    return report;
  };
  const CurrentReport without = power(0.0), with = power(150.0);
  EXPECT_NEAR(with.resistance - without.resistance, 150.0, 1e-6);
  EXPECT_NEAR(with.power / without.power, without.resistance / with.resistance, 1e-6);
}

TEST(Electrode, OnWhatConductsAsWellAsMetalTheCurrentIsHeld) {
  ThermalTissue brine;
  brine.electric_conductivity = 8.0;
  Bioheat heat(brine, BioheatOptions{}, flat());
  ElectrodeTip tip({}, {.body_resistance = 20.0, .least_load = 64.0});
  const CurrentReport report =
      tip.energise(heat, CurrentMode::kCut, 30.0, disc(2e-3), disc(2e-3), 1e-3);
  EXPECT_EQ(report.by_current, 1.0);
  EXPECT_NEAR(report.current, std::sqrt(30.0 / 64.0), 1e-9);
  EXPECT_LT(report.generated(), 20.0);
}

TEST(Electrode, FarFromTissueNothingFlowsAndItSaysSo) {
  Bioheat heat = liver();
  ElectrodeTip tip;
  ElectrodeContact away;
  away.depth = -5e-3;
  const CurrentReport report =
      tip.energise(heat, CurrentMode::kFulgurate, 30.0, away, away, kFrame);
  EXPECT_TRUE(report.open);
  EXPECT_EQ(report.power, 0.0);
  EXPECT_EQ(report.current, 0.0);
  EXPECT_EQ(heat.bricks().count(), 0u);
}

TEST(Electrode, PressingDeeperWidensTheContactUpToHalfTheBall) {
  Electrode ball;
  ball.tip_radius = 1e-3;
  ElectrodeContact contact;
  double last = 0.0;
  for (const double depth : {0.1e-3, 0.3e-3, 0.6e-3, 1e-3}) {
    contact.depth = depth;
    const double radius = contact_radius(ball, contact, 1000.0);
    EXPECT_GT(radius, last);
    last = radius;
  }
  EXPECT_NEAR(last, 1e-3, 1e-12);
  contact.depth = 5e-3;
  EXPECT_EQ(contact_radius(ball, contact, 1000.0), last);
}

TEST(Electrode, MetalWarmsOnTissueAndWarmsTissueLater) {
  Bioheat heat = liver();
  ElectrodeTip tip;
  for (int step = 0; step < 120; ++step) {
    tip.energise(heat, CurrentMode::kBlend, 20.0, disc(0.8e-3), disc(0.8e-3), kFrame);
    heat.step(kFrame);
  }
  const double hot = tip.excess();
  EXPECT_GT(hot, 20.0);
  EXPECT_GT(heat.book().instrument, 0.0);
  EXPECT_LT(std::abs(heat.book().residual()), 1e-4 * heat.book().delivered);
  // The generator is off, the tip still hot: it burns elsewhere.
  const Vec3 aside(20e-3, 0.0, 0.0);
  const double before = heat.book().instrument;
  for (int step = 0; step < 30; ++step) {
    tip.energise(heat, CurrentMode::kBlend, 0.0, disc(0.8e-3, aside), disc(0.8e-3, aside), kFrame);
    heat.step(kFrame);
  }
  EXPECT_LT(heat.book().instrument, before);
  EXPECT_LT(tip.excess(), hot);
  EXPECT_GT(heat.bricks().excess_at(heat.bricks().voxel_of(aside - Vec3(0, 0, 0.2e-3))), 1.0);
  // In the gas it cools by its shaft, by the gas and, as long as it is hot, by radiation.
  const double left = tip.excess();
  const Electrode& metal = tip.electrode();
  tip.cool(1.0);
  const double slowest =
      (metal.shaft_conductance + metal.surface * metal.gas_transfer) / metal.heat_capacity;
  EXPECT_LT(tip.excess(), left * std::exp(-slowest));
  EXPECT_GT(tip.excess(), 0.8 * left * std::exp(-slowest));
}

TEST(Electrode, AColdTipWithoutPowerCostsNothing) {
  Bioheat heat = liver();
  ElectrodeTip tip;
  tip.energise(heat, CurrentMode::kCut, 0.0, disc(1e-3), disc(1e-3), kFrame);
  EXPECT_EQ(heat.bricks().count(), 0u);
}

TEST(Electrode, AMovingTipLeavesAnEvenTrace) {
  Bioheat heat = liver();
  ElectrodeTip tip;
  // 40 mm/s: more than a voxel a step.
  for (int step = 0; step < 30; ++step) {
    const Vec3 from(40e-3 * step * kFrame, 0, 0), to(40e-3 * (step + 1) * kFrame, 0, 0);
    tip.energise(heat, CurrentMode::kCut, 40.0, disc(0.5e-3, from), disc(0.5e-3, to), kFrame);
    heat.step(kFrame);
  }
  double least = 1e9, most = 0.0;
  for (int x = 12; x < 28; ++x) {
    const double excess = heat.bricks().excess_at({x, 0, -2});
    least = std::min(least, excess);
    most = std::max(most, excess);
  }
  EXPECT_GT(least, 1.0);
  EXPECT_LT(most / least, 1.25);
}

TEST(Electrode, WhatCantBeIsRefusedAndNothingHappens) {
  Bioheat heat = liver();
  ElectrodeTip tip;
  const double nan = std::numeric_limits<double>::quiet_NaN();
  ElectrodeContact inside_out = disc(1e-3);
  inside_out.outward = Vec3::Zero();
  ElectrodeContact nowhere = disc(1e-3);
  nowhere.point.x() = nan;
  ElectrodeContact negative = disc(1e-3);
  negative.area = -1.0;
  for (const ElectrodeContact& bad : {inside_out, nowhere, negative})
    EXPECT_TRUE(tip.energise(heat, CurrentMode::kCut, 30.0, bad, bad, kFrame).refused);
  for (const double power : {-1.0, 1e5, nan})
    EXPECT_TRUE(
        tip.energise(heat, CurrentMode::kCut, power, disc(1e-3), disc(1e-3), kFrame).refused);
  for (const double dt : {0.0, -1.0, nan})
    EXPECT_TRUE(tip.energise(heat, CurrentMode::kCut, 30.0, disc(1e-3), disc(1e-3), dt).refused);
  EXPECT_EQ(heat.bricks().count(), 0u);

  Electrode bad;
  bad.tip_radius = -1e-3;
  const auto result = check(bad, -30.0);
  ASSERT_FALSE(result);
  ASSERT_EQ(result.error().messages.size(), 2u);
  EXPECT_NE(result.error().text().find("power"), std::string::npos);
  EXPECT_TRUE(check(Electrode{}, 30.0));
}

}  // namespace
}  // namespace viscera
