// The step of heat against closed forms.
#include "kernels/heat/bioheat.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "engine/verification/heat_solutions.h"

namespace viscera {
namespace {

constexpr double kFrame = 1.0 / 60.0;

// A bar along x from 0, one brick thick, whose sides pass nothing.
SignedDistance bar(double voxel) {
  const double edge = HeatBricks::kEdge * voxel;
  return [edge](const Vec3& p) {
    return std::max({-p.x(), -p.y(), p.y() - edge, -p.z(), p.z() - edge});
  };
}

BioheatOptions without_cooling(double voxel) {
  BioheatOptions options;
  options.voxel = voxel;
  options.cooling.coefficient = 0.0;
  options.followed = 0.01;
  return options;
}

// Greatest error over voxels within `reach` of the origin, over the greatest value.
template <class Exact>
double worst_error(const Bioheat& heat, double reach, const Exact& exact) {
  double error = 0.0, most = 0.0;
  for (std::size_t b = 0; b < heat.bricks().count(); ++b) {
    const HeatBrick& brick = heat.bricks().brick(b);
    for (int i = 0; i < BrickField::kVoxels; ++i) {
      const Vec3 at = heat.bricks().centre(brick, i);
      if (at.norm() > reach) continue;
      const double value = exact(at.norm());
      error = std::max(error, std::abs(brick.warm->excess[i] - value));
      most = std::max(most, std::abs(value));
    }
  }
  return error / most;
}

double pulse_error(double voxel, double dt, double time, HeatScheme scheme) {
  ThermalTissue tissue = plain_tissue();
  BioheatOptions options = without_cooling(voxel);
  options.followed = 1e-4;
  options.scheme = scheme;
  Bioheat heat(tissue, options);
  const double width = 1.5e-3, energy = 1.0;
  const Vec3 reach = Vec3::Constant(8e-3);
  set_excess(heat, Box(-reach, reach),
             [&](const Vec3& p) { return gaussian_pulse(tissue, energy, width, p.norm(), 0.0); });
  for (int step = 0; step < std::lround(time / dt); ++step) heat.step(dt);
  return worst_error(heat, 5e-3,
                     [&](double r) { return gaussian_pulse(tissue, energy, width, r, time); });
}

TEST(Bioheat, APulseSpreadsAsTheExactGaussianWithSecondOrderInSpace) {
  const double coarse = pulse_error(1e-3, 0.05, 4.0, HeatScheme::kSuper);
  const double middle = pulse_error(0.5e-3, 0.05, 4.0, HeatScheme::kSuper);
  const double fine = pulse_error(0.25e-3, 0.05, 4.0, HeatScheme::kSuper);
  EXPECT_LT(middle, 0.01);
  EXPECT_NEAR(std::log2(coarse / middle), 2.0, 0.25);
  EXPECT_NEAR(std::log2(middle / fine), 2.0, 0.2);
}

// Against the same voxels in much shorter steps, so that only the error in time is left.
double middle_after(double dt, HeatScheme scheme) {
  BioheatOptions options = without_cooling(0.5e-3);
  options.followed = 1e-5;
  options.scheme = scheme;
  ThermalTissue tissue = plain_tissue();
  Bioheat heat(tissue, options);
  const Vec3 reach = Vec3::Constant(7e-3);
  set_excess(heat, Box(-reach, reach),
             [&](const Vec3& p) { return gaussian_pulse(tissue, 1.0, 0.8e-3, p.norm(), 0.0); });
  for (int step = 0; step < std::lround(4.0 / dt); ++step) heat.step(dt);
  return heat.bricks().excess_at({0, 0, 0});
}

TEST(Bioheat, ExplicitStepsAreOfFirstOrderInTimeAndSuperStepsOfSecond) {
  const double exact = middle_after(1.0 / 256.0, HeatScheme::kSuper);
  const double first = std::abs(middle_after(0.25, HeatScheme::kExplicit) - exact);
  const double second = std::abs(middle_after(0.125, HeatScheme::kExplicit) - exact);
  EXPECT_NEAR(std::log2(first / second), 1.0, 0.15);
  const double wide = std::abs(middle_after(1.0, HeatScheme::kSuper) - exact);
  const double narrow = std::abs(middle_after(0.5, HeatScheme::kSuper) - exact);
  EXPECT_NEAR(std::log2(wide / narrow), 2.0, 0.4);
  EXPECT_LT(narrow, 0.5 * second);
}

TEST(Bioheat, AGaussianSourceGivesTheExactTemperatureAtTheLesionsEdge) {
  const ThermalTissue tissue = plain_tissue();
  Bioheat heat(tissue, without_cooling(0.5e-3));
  const double width = 1e-3, power = 0.7, time = 3.0;
  for (int step = 0; step < 180; ++step) {
    heat_gaussian(heat, Vec3::Zero(), width, power);
    heat.step(kFrame);
  }
  // 60 C, between voxels along x.
  double worst = 0.0;
  int edges = 0;
  for (int x = 0; x < 12; ++x) {
    const Vec3 at = (Vec3(x, 0, 0).array() + 0.5) * 0.5e-3;
    const double exact = gaussian_source(tissue, power, width, at.norm(), time);
    if (exact < 15.0 || exact > 35.0) continue;
    worst = std::max(worst, std::abs(heat.bricks().excess_at({x, 0, 0}) - exact) / exact);
    ++edges;
  }
  EXPECT_GE(edges, 1);
  EXPECT_LT(worst, 0.02);
}

TEST(Bioheat, APointSourceIsExactAFewVoxelsAway) {
  const ThermalTissue tissue = plain_tissue();
  BioheatOptions options = without_cooling(0.25e-3);
  options.followed = 1e-4;
  Bioheat heat(tissue, options);
  const double power = 0.01, time = 4.0;
  HeatBrick* middle = heat.bricks().warm_up({0, 0, 0});
  for (int step = 0; step < 240; ++step) {
    heat.heat_voxel(*middle, 3 + 8 * (3 + 8 * 3), power);
    heat.step(kFrame);
  }
  for (const int away : {4, 6, 8}) {
    const double exact = point_source(tissue, power, away * 0.25e-3, time);
    // Along the axes cubes conduct best: (h / r)^2 / 4 of the temperature that there will be in the
    // end.
    const double lasting = power / (4.0 * std::numbers::pi * tissue.conductivity * away * 0.25e-3);
    EXPECT_NEAR(heat.bricks().excess_at({3 + away, 3, 3}), exact, 0.02 * lasting) << away;
    EXPECT_NEAR(heat.bricks().excess_at({3, 3 - away, 3}), exact, 0.02 * lasting) << away;
  }
}

TEST(Bioheat, HeldHeatReachesIntoPerfusedTissueAsPennesSays) {
  ThermalTissue tissue = plain_tissue();
  tissue.perfusion = ThermalTissue{}.perfusion;
  tissue.metabolic_heat = ThermalTissue{}.metabolic_heat;
  const double h = 0.5e-3;
  Bioheat heat(tissue, without_cooling(h), bar(h));
  heat.bricks().warm_up({0, 0, 0});
  for (int step = 0; step < 3000; ++step) {
    hold_layer(heat, 0, 0, 40.0);
    heat.step(0.2);
  }
  const double reach = perfused_reach(tissue);
  EXPECT_NEAR(reach, 3.0e-3, 0.1e-3);
  for (const int x : {4, 8, 16, 24}) {
    const double exact = 40.0 * std::exp(-x * h / reach);
    EXPECT_NEAR(heat.bricks().excess_at({x, 3, 3}), exact, 0.005 * exact + 0.01) << x;
  }
}

TEST(Bioheat, WaterBoilsAwayBehindStefansFront) {
  const ThermalTissue tissue = plain_tissue();
  const double h = 0.1e-3, wall = 363.0;
  Bioheat heat(tissue, without_cooling(h), bar(h));
  HeatBrick* first = heat.bricks().warm_up({0, 0, 0});
  // The wall is the middle of the first layer, which is dry from the start.
  for (int i = 0; i < BrickField::kVoxels; i += 8) first->water[i] = 0.0f;
  const BoilingFront exact(tissue, wall, heat.options().body);
  const double dt = 4e-3;
  double time = 0.0;
  for (const double until : {5.0, 20.0}) {
    while (time < until - 0.5 * dt) {
      hold_layer(heat, 0, 0, wall);
      heat.step(dt);
      time += dt;
    }
    double front = 0.5 * h;
    for (int x = 1; x < 60; ++x) front += (1.0 - heat.bricks().water_at({x, 3, 3})) * h;
    EXPECT_NEAR(front, exact.position(time), 0.02 * exact.position(time)) << time;
    for (const int x : {2, 30, 50}) {
      EXPECT_NEAR(heat.bricks().excess_at({x, 3, 3}), exact.excess(x * h, time), 0.02 * wall) << x;
    }
  }
  EXPECT_GT(exact.position(time), 8 * h);
}

TEST(Bioheat, ALongStepIsAsStableAsAShortOne) {
  for (const HeatScheme scheme : {HeatScheme::kFewest, HeatScheme::kExplicit, HeatScheme::kSuper}) {
    ThermalTissue tissue = plain_tissue();
    BioheatOptions options = without_cooling(0.1e-3);
    options.scheme = scheme;
    Bioheat heat(tissue, options);
    const Vec3 reach = Vec3::Constant(1.2e-3);
    set_excess(heat, Box(-reach, reach),
               [&](const Vec3& p) { return gaussian_pulse(tissue, 5e-3, 0.3e-3, p.norm(), 0.0); });
    const double most = heat.bricks().excess_at({0, 0, 0});
    for (int step = 0; step < 10; ++step) heat.step(0.5);
    EXPECT_GT(heat.bricks().excess_at({0, 0, 0}), 0.0);
    EXPECT_LT(heat.bricks().excess_at({0, 0, 0}), most);
    EXPECT_LT(heat.greatest_excess(), most);
  }
}

TEST(Bioheat, SuperStepsTakeFewerPassesOnFineVoxels) {
  const auto passes = [](HeatScheme scheme) {
    BioheatOptions options = without_cooling(0.05e-3);
    options.scheme = scheme;
    Bioheat heat(plain_tissue(), options);
    set_excess(heat, Box(Vec3::Zero(), Vec3::Constant(0.3e-3)), [](const Vec3&) { return 20.0; });
    heat.step(kFrame);
    return heat.passes_of_last_step();
  };
  EXPECT_LT(passes(HeatScheme::kFewest), passes(HeatScheme::kExplicit));
  BioheatOptions coarse = without_cooling(0.5e-3);
  Bioheat heat(plain_tissue(), coarse);
  set_excess(heat, Box(Vec3::Zero(), Vec3::Constant(2e-3)), [](const Vec3&) { return 20.0; });
  heat.step(kFrame);
  EXPECT_EQ(heat.passes_of_last_step(), 1);
}

TEST(Bioheat, AWarmSurfaceCoolsAsItsGasAndVapourSay) {
  // A brick of its own in the gas, so conductive that it has one temperature.
  ThermalTissue tissue = plain_tissue();
  tissue.conductivity = tissue.dry_conductivity = 50.0;
  BioheatOptions options;
  const double edge = 4e-3;
  const SignedDistance block = [edge](const Vec3& p) {
    return (p - Vec3::Constant(0.5 * edge)).cwiseAbs().maxCoeff() - 0.5 * edge + 0.25e-3;
  };
  Bioheat heat(tissue, options, block);
  set_excess(heat, Box(Vec3::Constant(1e-3), Vec3::Constant(2e-3)),
             [](const Vec3&) { return 40.0; });
  const double capacity = heat_capacity(tissue, 1.0) * tissue_volume(heat);
  double area = 0.0;
  for (const BrickGeometry::Surface& face : heat.bricks().brick(0).geometry->surface)
    area += face.area * options.voxel * options.voxel;
  EXPECT_NEAR(area, 6.0 * 3.5e-3 * 3.5e-3, 0.1 * area);
  // In carbon dioxide vapour spreads faster than heat: Lewis' number is 0.59, to the two thirds
  // 0.70.
  const double transfer =
      options.cooling.coefficient / options.cooling.gas_capacity / std::pow(0.59, 2.0 / 3.0);
  const double resting = water::vapour_density(options.body);
  double excess = 40.0;
  for (int step = 0; step < 600; ++step) {
    heat.step(kFrame);
    const double flux =
        options.cooling.coefficient * excess +
        water::kLatentHeat * transfer * (water::vapour_density(options.body + excess) - resting);
    excess -= kFrame * flux * area / capacity;
  }
  EXPECT_LT(excess, 39.0);
  EXPECT_NEAR(heat.bricks().excess_at({4, 4, 4}), excess, 0.02 * (40.0 - excess));
  EXPECT_GT(heat.book().gas, 0.0);
  EXPECT_GT(heat.book().latent, heat.book().gas);
}

TEST(Bioheat, NothingHappensWithoutTimeOrHeat) {
  Bioheat heat(ThermalTissue{}, BioheatOptions{});
  heat.step(kFrame);
  EXPECT_EQ(heat.bricks().count(), 0u);
  set_excess(heat, Box(Vec3::Zero(), Vec3::Constant(1e-3)), [](const Vec3&) { return 20.0; });
  for (const double dt : {0.0, -1.0, std::numeric_limits<double>::quiet_NaN()}) heat.step(dt);
  EXPECT_EQ(heat.bricks().excess_at({0, 0, 0}), 20.0);
  EXPECT_EQ(heat.version(), 0u);
}

}  // namespace
}  // namespace viscera
