// Beds whose organs are cut.
#include "engine/features/beds/cut_beds.h"

#include <gtest/gtest.h>

#include "engine/features/beds/beds.h"
#include "engine/features/contact/contact.h"
#include "engine/features/gravity/gravity_keys.h"
#include "engine/features/parting/parting.h"
#include "engine/simulator/build.h"
#include "kernels/finite/finite_solver.h"
#include "tests/support/cutting.h"
#include "tests/support/lifted_block.h"
#include "tests/support/small_world.h"

namespace viscera::test {
namespace {

// The block is cut by the first, and no bond has softened yet; all have parted by the second [s].
constexpr double kCutBy = 1.2, kLiftAll = 4.5;

/// The block may be cut, and is carried away so slowly that a blade is through before it moves.
SceneDescription bedded_to_cut() {
  SceneDescription scene =
      lifted_block({.response = Response::kFinite, .period = 10.0, .modulus = 300e3});
  scene.organs[0].extras.set(CuttableDescription{0.25e-3});
  return scene;
}

/// Upright through the block from side to side, so wide, down to this height.
SceneDescription split_down_to(double z, double thickness) {
  SceneDescription scene = bedded_to_cut();
  scene.instruments = {upright_scalpel(Vec3(0, -12e-3, z), Vec3(0, 12e-3, z), 0.05, 0.35,
                                       BladeDescription{14e-3, thickness})};
  return scene;
}

/// Along the floor: what is below this height comes off the block.
SceneDescription undercut_at(double z) {
  SceneDescription scene = bedded_to_cut();
  InstrumentDescription scalpel = straight_tool(
      "scalpel", InstrumentKind::kScalpel, 0.3e-3,
      {{0.0, Vec3(-12e-3, -12e-3, z), 0.0, 1.0}, {0.3, Vec3(-12e-3, 12e-3, z), 0.0, 1.0}});
  scalpel.trocar = Vec3(20.0, 0.0, z);
  scalpel.extras.set(BladeDescription{24e-3, 0.5e-3});
  scene.instruments = {scalpel};
  return scene;
}

TEST(CutBeds, BondsHoldOnWhenTheTissueAboveThemIsCut) {
  auto world = build(split_down_to(-2.5e-3, 0.5e-3));
  ASSERT_TRUE(world);
  const double until_then = lift(*world, kCutBy).work;
  ASSERT_GE(world->all<OrganCut>()[0].bodies, 1u);
  ASSERT_FALSE(world->all<OrganCut>()[0].pending);
  const Entity bed = world->all<Bed>().owner(0);
  ASSERT_TRUE(world->find<BedPlacesLeft>(bed));
  EXPECT_EQ(bed_figures(*world)[0].whole, bed_figures(*world)[0].bonds);
  EXPECT_EQ(tissue_left_on(*world, bed), 0.0);
  // Their ends are where they were.
  const BedPlaces &now = places_now(*world, bed), &whole = world->find<Bed>(bed)->places;
  for (std::size_t b = 0; b < whole.layer.areas.size(); ++b)
    EXPECT_LT((now.ends[0][b] - whole.ends[0][b]).norm(), 1e-6);
  const double work = until_then + lift(*world, kLiftAll).work;
  const BedFigures parted = bed_figures(*world)[0];
  EXPECT_EQ(parted.by_force, parted.bonds);
  EXPECT_EQ(parted.by_cut, 0u);
  EXPECT_NEAR(work, kLiftedBed.toughness * parted.area, 0.05 * work) << "as of a whole block";
}

TEST(CutBeds, WhereABladeTakesTheirTissueBondsAreCut) {
  // The tip stays off the floor; round as it is, the cut below it is nearly as wide.
  constexpr double kWide = 3.5e-3;
  auto world = build(split_down_to(-3.45e-3, kWide));
  ASSERT_TRUE(world);
  const double until_then = lift(*world, kCutBy).work;
  ASSERT_GE(world->all<OrganCut>()[0].bodies, 1u) << world->all<OrganLeft>()[0].refusal;
  ASSERT_FALSE(world->all<OrganCut>()[0].pending);
  const Entity bed = world->all<Bed>().owner(0);
  const BedPlaces &now = places_now(*world, bed), &whole = world->find<Bed>(bed)->places;
  const BondStates& bonds = world->find<BedState>(bed)->bonds;
  const BedFigures figures = bed_figures(*world)[0];
  EXPECT_GT(figures.by_cut, 0u);
  EXPECT_EQ(figures.whole + figures.by_cut, figures.bonds);
  std::size_t shares = 0;
  for (std::size_t b = 0; b < figures.bonds; ++b) {
    const double aside = std::abs(whole.ends[0][b].x());
    if (aside < 0.2 * kWide) {
      EXPECT_EQ(bonds.parted_by[b], kPartedByCut) << aside;
    }
    if (aside > 0.6 * kWide) {
      EXPECT_EQ(bonds.parted_by[b], 0) << aside;
    }
    if (!holds(now.layer, bonds, b)) continue;
    // No bond ties one side of the cut to the other.
    ASSERT_LT(now.layer.shares.begin[b], now.layer.shares.begin[b + 1]) << b;
    for (std::uint32_t e = now.layer.shares.begin[b]; e < now.layer.shares.begin[b + 1]; ++e) {
      const double cell = now.cells[0][now.layer.shares.cells[e]].position.x();
      EXPECT_GT(cell * now.ends[0][b].x(), 0.0);
      ++shares;
    }
  }
  EXPECT_GT(shares, 2 * figures.whole);
  const double work = until_then + lift(*world, kLiftAll).work;
  const BedFigures parted = bed_figures(*world)[0];
  EXPECT_EQ(parted.by_force + parted.by_cut, parted.bonds);
  EXPECT_NEAR(work, kLiftedBed.toughness * parted.torn, 0.05 * work) << "of bonds that held";
}

TEST(CutBeds, WhatIsCutOffAndHangsOnTheBedIsToldAsLeftThere) {
  constexpr double kCut = -2e-3, kBlade = 0.5e-3;
  auto world = build(undercut_at(kCut));
  ASSERT_TRUE(world);
  step_until(*world, kCutBy);
  ASSERT_GE(world->all<OrganCut>()[0].bodies, 1u) << world->all<OrganLeft>()[0].refusal;
  const Entity bed = world->all<Bed>().owner(0);
  const double sheet = 20e-3 * 20e-3 * (kCut - 0.5 * kBlade - -4e-3);
  EXPECT_NEAR(tissue_left_on(*world, bed), sheet, 0.03 * sheet);
  step_until(*world, kLiftAll);
  // The block has gone up by some 4 mm, and what was cut off it lies where it lay.
  const BedFigures figures = bed_figures(*world)[0];
  EXPECT_EQ(figures.whole, figures.bonds);
  EXPECT_LT(figures.work, 1e-3 * kLiftedBed.toughness * figures.area);
  EXPECT_NEAR(tissue_left_on(*world, bed), sheet, 0.03 * sheet);
  EXPECT_LT(figures.greatest_force, 0.1 * kLiftedBed.strength * figures.area);
}

TEST(CutBeds, ScissorsPartTheBondsOnWhichTheyCloseAndNoOthers) {
  for (const bool closes : {false, true}) {
    // Of organs that nothing cuts. Along the edge of the block, just over the bed.
    SceneDescription scene = lifted_block({.way = Vec3::Zero()});
    const Vec3 beside(9e-3, -16e-3, -3.65e-3);
    InstrumentDescription scissors =
        straight_tool("scissors", InstrumentKind::kScissors, 0.2e-3,
                      {{0.0, beside, 0.0, 1.0},
                       {0.2, beside + Vec3(0, 16e-3, 0), 0.0, 1.0},
                       {0.5, beside + Vec3(0, 16e-3, 0), 0.0, closes ? 0.0 : 1.0}});
    scissors.trocar = Vec3(9e-3, -20.0, -3.65e-3);
    scissors.extras.set(BladeDescription{8e-3, 0.4e-3});
    scene.instruments = {scissors};
    auto world = build(scene);
    ASSERT_TRUE(world);
    step_until(*world, 0.6);
    const BedFigures figures = bed_figures(*world)[0];
    EXPECT_EQ(figures.by_cut > 0, closes) << figures.by_cut;
    EXPECT_EQ(figures.by_force + figures.by_heat, 0u);
    const BedPlaces& places = places_now(*world, world->all<Bed>().owner(0));
    const BondStates& bonds = world->all<BedState>()[0].bonds;
    for (std::size_t b = 0; b < figures.bonds; ++b) {
      if (bonds.parted_by[b] == 0) continue;
      EXPECT_LT(std::abs(places.ends[0][b].x() - 9e-3), 1.5e-3);
      EXPECT_GT(places.ends[0][b].y(), -9e-3);
      EXPECT_LT(places.ends[0][b].y(), 1e-3);
    }
  }
}

TEST(CutBeds, ASavedStateGoesOnToTheSameBits) {
  auto world = build(split_down_to(-3.45e-3, 3.5e-3));
  ASSERT_TRUE(world);
  auto fresh = start_world(world->shared_model());
  ASSERT_TRUE(fresh);
  step_until(**fresh, 0.1);
  const auto whole = (*fresh)->save_state();
  step_until(*world, kCutBy);
  ASSERT_GE(world->all<OrganCut>()[0].bodies, 1u);
  step_until(*world, world->time() + 0.2);
  auto other = start_world(world->shared_model());
  ASSERT_TRUE(other);
  ASSERT_TRUE((*other)->load_state(world->save_state()));
  EXPECT_EQ((*other)->state_difference(*world), "");
  const double end = world->time() + 0.3;
  step_until(*world, end);
  step_until(**other, end);
  EXPECT_EQ((*other)->state_difference(*world), "");
  // And back to where nothing was cut.
  ASSERT_TRUE(world->load_state(whole));
  step_until(*world, 0.2);
  step_until(**fresh, 0.2);
  EXPECT_EQ((*fresh)->state_difference(*world), "");
}

}  // namespace
}  // namespace viscera::test
