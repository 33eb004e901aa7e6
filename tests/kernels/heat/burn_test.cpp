#include "kernels/heat/burn.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace viscera {
namespace {

double total(const BrickField& field) {
  double sum = 0.0;
  for (std::size_t b = 0; b < field.brick_count(); ++b) {
    for (const float value : field.brick(b)) sum += value;
  }
  return sum * std::pow(field.voxel(), 3);
}

// The largest difference of two damage fields, over the voxels of both.
double largest_difference(const BrickField& a, const BrickField& b) {
  double largest = 0.0;
  for (const BrickField* field : {&a, &b}) {
    for (const BrickField::Index& brick : field->brick_indices()) {
      for (int i = 0; i < BrickField::kVoxels; ++i) {
        const BrickField::Index voxel =
            brick * BrickField::kEdge + BrickField::Index(i % 8, i / 8 % 8, i / 64);
        largest = std::max(largest, std::abs(double{a.at(voxel)} - double{b.at(voxel)}));
      }
    }
  }
  return largest;
}

// Distance from the centre at which the damage falls below a level, along a direction [m].
double reach(const BrickField& field, const Vec3& centre, const Vec3& direction, double level) {
  double r = 0.0;
  while (field.sample(centre + r * direction) >= level) r += 1e-5;
  return r;
}

const Vec3 kSpot(0.0113, -0.0207, 0.0052);

TEST(Burn, SoundTissueAbsorbsAllTheEnergyAndTheFieldHoldsIt) {
  BrickField damage;
  const BurnParameters parameters;
  const double absorbed = deposit_burn(damage, kSpot, kSpot, 5.0, 0.02, parameters);
  EXPECT_NEAR(absorbed, 0.1, 1e-12);
  EXPECT_NEAR(total(damage) * parameters.energy_per_volume, 0.1, 1e-6);
}

TEST(Burn, ThirtyWattsForASecondCharTheCoreAndBlanchTheRim) {
  BrickField damage;
  for (int frame = 0; frame < 60; ++frame) {
    deposit_burn(damage, kSpot, kSpot, 30.0, 1.0 / 60.0, {});
  }
  const Vec3 out = Vec3(1.0, 2.0, -1.0).normalized();
  EXPECT_NEAR(damage.sample(kSpot), 1.0, 1e-6);
  EXPECT_NEAR(reach(damage, kSpot, out, 0.9), 1.05e-3, 0.1e-3);
  EXPECT_NEAR(reach(damage, kSpot, out, 0.05), 1.8e-3, 0.15e-3);
  EXPECT_EQ(damage.sample(kSpot + 3e-3 * out), 0.0);
}

TEST(Burn, IsRoundInEveryDirectionAtHalfAMillimetre) {
  BrickField damage;
  deposit_burn(damage, kSpot, kSpot, 30.0, 1.0, {});
  for (const double level : {0.1, 0.3, 0.6}) {
    double least = 1.0, most = 0.0;
    for (int i = 0; i < 200; ++i) {
      const double z = -1.0 + (i + 0.5) / 100.0;
      const double angle = 2.399963 * i;
      const double across = std::sqrt(1.0 - z * z);
      const double r =
          reach(damage, kSpot, {across * std::cos(angle), across * std::sin(angle), z}, level);
      least = std::min(least, r);
      most = std::max(most, r);
    }
    EXPECT_LT(most - least, 0.12 * most) << "level " << level;
  }
}

TEST(Burn, OneStepOrTenGiveTheSameField) {
  const Vec3 end = kSpot + Vec3(3e-3, 1e-3, 0.0);
  for (const double power : {5.0, 60.0}) {
    BrickField once, often;
    const double absorbed_once = deposit_burn(once, kSpot, end, power, 0.5, {});
    double absorbed_often = 0.0;
    for (int i = 0; i < 10; ++i) {
      const Vec3 from = kSpot + i / 10.0 * (end - kSpot);
      const Vec3 to = kSpot + (i + 1) / 10.0 * (end - kSpot);
      absorbed_often += deposit_burn(often, from, to, power, 0.05, {});
    }
    EXPECT_NEAR(absorbed_often, absorbed_once, 0.01 * absorbed_once);
    EXPECT_LT(largest_difference(once, often), 0.03);
  }
}

TEST(Burn, MovingHookLeavesATraceOfConstantWidth) {
  BrickField damage;
  const Vec3 direction = Vec3(1.0, 0.3, 0.2).normalized();
  for (int frame = 0; frame < 60; ++frame) {
    deposit_burn(damage, kSpot + frame * 4e-4 * direction, kSpot + (frame + 1) * 4e-4 * direction,
                 30.0, 1.0 / 60.0, {});
  }
  const Vec3 across = direction.cross(Vec3::UnitZ()).normalized();
  double least = 1.0, most = 0.0;
  for (double s = 5e-3; s < 19e-3; s += 0.1e-3) {
    const double width = reach(damage, kSpot + s * direction, across, 0.2);
    least = std::min(least, width);
    most = std::max(most, width);
  }
  EXPECT_GT(least, 0.7e-3);
  // A third of a voxel: what trilinear sampling of half-millimetre voxels leaves of a round edge.
  EXPECT_LT(most - least, damage.voxel() / 3.0);
}

TEST(Burn, CharredTissueAbsorbsNothingMoreAndDamageStaysBelowOne) {
  BrickField damage;
  double last = 0.0, first = 0.0, sum = 0.0;
  for (int i = 0; i < 400; ++i) {
    last = deposit_burn(damage, kSpot, kSpot, 40.0, 0.1, {});
    if (i == 0) first = last;
    sum += last;
  }
  EXPECT_GT(first, 2.0);
  EXPECT_LT(last, 0.05 * first);
  EXPECT_NEAR(total(damage) * BurnParameters{}.energy_per_volume, sum, 1e-5 * sum);
  for (std::size_t b = 0; b < damage.brick_count(); ++b) {
    for (const float value : damage.brick(b)) ASSERT_LE(value, 1.0f);
  }
}

TEST(Burn, AllocatesOnlyBricksThatItTouches) {
  BrickField damage;
  deposit_burn(damage, Vec3::Zero(), Vec3(0.05, 0.05, 0.05), 30.0, 0.1, {});
  // The bounding box of this diagonal holds more than two thousand bricks.
  EXPECT_LT(damage.brick_count(), 150u);
}

TEST(Burn, NothingHappensWithoutPositiveFinitePowerTimeAndRadius) {
  BrickField damage;
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(deposit_burn(damage, kSpot, kSpot, 0.0, 0.1, {}), 0.0);
  EXPECT_EQ(deposit_burn(damage, kSpot, kSpot, -30.0, -0.1, {}), 0.0);
  EXPECT_EQ(deposit_burn(damage, kSpot, kSpot, nan, 0.1, {}), 0.0);
  EXPECT_EQ(deposit_burn(damage, kSpot, {nan, 0.0, 0.0}, 30.0, 0.1, {}), 0.0);
  BurnParameters flat;
  flat.radius = 0.0;
  EXPECT_EQ(deposit_burn(damage, kSpot, kSpot, 30.0, 0.1, flat), 0.0);
  EXPECT_EQ(damage.brick_count(), 0u);
}

}  // namespace
}  // namespace viscera
