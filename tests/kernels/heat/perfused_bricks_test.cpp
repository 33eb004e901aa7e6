// Tissue that blood doesn't reach: pieces that a cut has taken off.
#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "kernels/base/archive.h"
#include "tests/kernels/heat/heated_liver.h"

namespace viscera {
namespace {

/// Heat capacity of wet tissue over what its blood, less its metabolism, carries off [s].
double drained_within(const ThermalTissue& tissue) {
  return heat_capacity(tissue, 1.0) / (tissue.perfusion * water::kBloodDensity * water::kBloodHeat -
                                       tissue.metabolic_heat * tissue.metabolic_slope);
}

/// A brick in the middle of tissue, evenly warm, whose sides pass nothing.
Bioheat warm_brick(const std::vector<ShapedBrick>& shapes) {
  BioheatOptions options;
  options.scheme = HeatScheme::kExplicit;
  options.cooling.coefficient = 0.0;
  options.followed = 5.0;  // it isn't as warm, so nothing is followed beyond it
  Bioheat heat(ThermalTissue{}, options);
  set_excess(heat, Box(Vec3::Constant(1e-3), Vec3::Constant(2e-3)),
             [](const Vec3&) { return 4.0; });
  heat.take_shapes(shapes);
  heat.begin_book();
  return heat;
}

TEST(PerfusedBricks, WhatIsCutOffKeepsTheWarmthThatBloodWouldCarryOff) {
  constexpr double kSeconds = 20.0;
  Bioheat held = warm_brick({}), off = warm_brick({{BrickIndex::Zero(), nullptr}});
  ASSERT_EQ(held.bricks().count(), 1u);
  EXPECT_EQ(held.bricks().brick(0).geometry, BrickGeometry::whole());
  EXPECT_EQ(off.bricks().brick(0).geometry, BrickGeometry::whole_cut_off());
  for (Bioheat* heat : {&held, &off}) wait(*heat, kSeconds);
  // Without gradients Pennes' equation is a decay; single precision rounds 1200 steps to 1e-4.
  const double left = 4.0 * std::exp(-kSeconds / drained_within(held.tissue()));
  EXPECT_LT(left, 3.2);
  EXPECT_NEAR(held.bricks().excess_at({3, 3, 3}), left, 5e-4 * left);
  for (const float excess : off.bricks().brick(0).warm->excess) ASSERT_EQ(excess, 4.0f);
  const HeatBook drained = held.book(), kept = off.book();
  EXPECT_GT(drained.metabolic, 0.0);
  EXPECT_NEAR(drained.perfused - drained.metabolic, -drained.stored, 1e-3 * drained.perfused);
  EXPECT_EQ(kept.perfused, 0.0);
  EXPECT_EQ(kept.metabolic, 0.0);
  EXPECT_EQ(kept.stored, 0.0);
  EXPECT_EQ(kept.removed, 0.0);
}

/// A plate across x, from 1 to 1.6 mm, is gone of the liver; nothing holds what lies beyond it.
constexpr double kPlate = 1.3e-3;
std::vector<ShapedBrick> beside_a_plate(double voxel, bool severed) {
  const SignedDistance left = [](const Vec3& p) {
    return std::max(half_space()(p), 0.3e-3 - std::abs(p.x() - kPlate));
  };
  std::vector<ShapedBrick> shapes;
  for (int x = -3; x < 3; ++x)
    for (int y = -3; y < 3; ++y)
      for (int z = -3; z < 1; ++z) {
        ShapedBrick& shape = shapes.emplace_back();
        shape.index = {x, y, z};
        if (severed && x > 0) continue;
        shape.geometry = make_geometry(shape.index, voxel, left);
        if (!severed || x < 0) continue;
        std::vector<float> perfused;
        for (int v = 0; v < BrickField::kVoxels; ++v)
          perfused.push_back((v % BrickField::kEdge + 0.5) * voxel > kPlate ? 0.0f : 1.0f);
        shape.geometry = with_blood(shape.geometry, perfused);
      }
  return shapes;
}

TEST(PerfusedBricks, TheBookClosesWhereHalfOfWhatIsWarmIsCutOff) {
  BioheatOptions options;
  std::vector<HeatBook> books;
  std::vector<double> beyond;
  for (const bool severed : {false, true}) {
    Bioheat heat(ThermalTissue{}, options, half_space());
    heat.take_shapes(beside_a_plate(options.voxel, severed));
    for (int step = 0; step < 120; ++step) {
      for (const double x : {0.4e-3, 4e-3})
        heat_gaussian(heat, Vec3(x, 0.1e-3, -0.5e-3), 0.6e-3, 0.05);
      heat.step(kPictureTime);
    }
    wait(heat, 10.0);
    books.push_back(heat.book());
    beyond.push_back(heat.bricks().excess_at(heat.bricks().voxel_of(Vec3(4e-3, 0, -1e-3))));
    EXPECT_LT(std::abs(books.back().residual()), 2e-4 * books.back().delivered)
        << books.back().residual();
  }
  // About as much is warm on either side; blood takes from one.
  EXPECT_GT(books[1].perfused, 0.3 * books[0].perfused);
  EXPECT_LT(books[1].perfused, 0.6 * books[0].perfused);
  EXPECT_NEAR(books[1].metabolic / books[1].perfused, books[0].metabolic / books[0].perfused, 1e-6);
  EXPECT_GT(books[1].stored, books[0].stored);
  // Some 12 s of blood have left 5/6.
  EXPECT_GT(beyond[1], 1.05 * beyond[0]);
  EXPECT_LT(beyond[1], 1.3 * beyond[0]);
}

TEST(PerfusedBricks, AStateThatIsRestoredIsPerfusedAsItsShapesSay) {
  const double voxel = 0.5e-3;
  const BrickIndex deep(0, 0, -1), beside(1, 0, -1), above(2, 0, 0), held(3, 0, -1);
  std::vector<float> half(BrickField::kVoxels, 1.0f);
  for (std::size_t v = 0; v < 256; ++v) half[v] = 0.0f;
  const std::vector<ShapedBrick> shapes = {
      {deep, nullptr},
      {beside, with_blood(make_geometry(beside, voxel, half_space()), half)},
      {above, nullptr}};
  HeatBricks bricks(voxel, half_space(), 100), other(voxel, half_space(), 100);
  for (HeatBricks* each : {&bricks, &other}) each->take_shapes(shapes);
  for (const BrickIndex& index : {deep, beside, above, held})
    ASSERT_NE(bricks.warm_up(index), nullptr);
  const std::vector<std::byte> bytes = saved(bricks);
  ByteReader reader(bytes);
  read(reader, other);
  ASSERT_FALSE(reader.failed());
  for (const HeatBricks* each : {&bricks, &other}) {
    EXPECT_EQ(each->find(deep)->geometry, BrickGeometry::whole_cut_off());
    EXPECT_EQ(each->find(held)->geometry, BrickGeometry::whole());
    EXPECT_EQ(each->find(beside)->geometry->perfused, half);
    const BrickGeometry& cut_off = *each->find(above)->geometry;
    for (std::size_t v = 0; v < BrickField::kVoxels; ++v) ASSERT_EQ(cut_off.perfused_at(v), 0.0f);
    EXPECT_EQ(cut_off.fraction, make_geometry(above, voxel, half_space())->fraction);
  }
  // Whole again, all of it has blood.
  other.take_shapes({});
  EXPECT_EQ(other.find(deep)->geometry, BrickGeometry::whole());
  EXPECT_EQ(other.find(above)->geometry->perfused_at(0), 1.0f);
}

TEST(PerfusedBricks, WhatIsCutOffAndColdTakesLittleMemory) {
  HeatBricks bricks(0.5e-3, half_space(), 100);
  std::vector<ShapedBrick> shapes;
  for (int i = 0; i < 1000; ++i) shapes.push_back({{i % 10, i / 10 % 10, -i / 100}, nullptr});
  bricks.take_shapes(shapes);
  EXPECT_LT(bricks.memory_bytes(), shapes.size() * 128);
}

}  // namespace
}  // namespace viscera
