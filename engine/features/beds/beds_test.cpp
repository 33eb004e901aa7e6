// Organs that a bed holds together, until it parts.
#include "engine/features/beds/beds.h"

#include <gtest/gtest.h>

#include <cmath>

#include "engine/features/cautery/cautery.h"
#include "engine/features/deformation/deformation_flags.h"
#include "engine/features/touching/touching.h"
#include "engine/simulation/prepare.h"
#include "engine/simulator/build.h"
#include "tests/support/lifted_block.h"
#include "tests/support/paths.h"
#include "tests/support/same_runs.h"
#include "tests/support/small_world.h"

namespace viscera::test {
namespace {

class Bedded : public testing::TestWithParam<Response> {};

TEST_P(Bedded, ABlockThatIsCarriedAwayTakesItsBedsToughnessToPart) {
  for (const Vec3& way : {Vec3(0, 0, 4e-3), Vec3(4e-3, 0, 0)}) {
    // As stiff as bone, it opens as its hold goes.
    auto world = build(lifted_block({.response = GetParam(), .way = way, .modulus = 3e6}));
    ASSERT_TRUE(world);
    const Lifted lifted = lift(*world, 1.0);
    const BedFigures bed = bed_figures(*world)[0];
    EXPECT_EQ(bed.whole, 0u);
    EXPECT_EQ(bed.by_force, bed.bonds);
    EXPECT_NEAR(bed.work, kLiftedBed.toughness * bed.area, 1e-9);
    EXPECT_NEAR(lifted.work, bed.work, 0.015 * bed.work) << way.transpose();
    EXPECT_LT(lifted.farthest_off, 0.05) << way.transpose();
    EXPECT_FALSE(lifted.flags.has(kContactNotConverged));
    step_until(*world, 1.5);
    EXPECT_EQ(pull_of_bed(*world), Vec3(Vec3::Zero())) << "what has parted doesn't hold again";
  }
}

TEST_P(Bedded, AFilmOverTheEdgeTakesItsWorkToo) {
  auto scene = lifted_block({.response = GetParam(), .way = Vec3(0, 0, 6e-3), .modulus = 3e6});
  BedDescriptions beds = *scene.extras.find<BedDescriptions>();
  beds[0].film = CohesiveLaw{20.0, 20e3, 0.03};
  scene.extras.set(beds);
  auto world = build(scene);
  ASSERT_TRUE(world);
  const double around = bed_figures(*world)[0].film;
  EXPECT_NEAR(around, 4.0 * 20e-3, 0.2 * 4.0 * 20e-3) << "around the block's foot";
  const Lifted lifted = lift(*world, 1.0);
  const BedFigures bed = bed_figures(*world)[0];
  EXPECT_EQ(bed.whole, 0u);
  EXPECT_EQ(bed.film_parted, around);
  EXPECT_NEAR(bed.work, kLiftedBed.toughness * bed.area + 0.03 * around, 1e-9);
  EXPECT_NEAR(lifted.work, bed.work, 0.02 * bed.work);
}

TEST_P(Bedded, ASoftBlockStoresWorkButPartsByTheSame) {
  auto world = build(lifted_block({.response = GetParam(), .modulus = 300e3, .soft_floor = true}));
  ASSERT_TRUE(world);
  const Lifted lifted = lift(*world, 1.0);
  const BedFigures bed = bed_figures(*world)[0];
  EXPECT_EQ(bed.by_force, bed.bonds);
  EXPECT_NEAR(lifted.work, bed.work, 0.03 * bed.work);
  EXPECT_LT(lifted.greatest, kLiftedBed.strength * bed.area);
}

TEST_P(Bedded, BothOrgansFeelTheSame) {
  auto world = build(lifted_block({.response = GetParam(), .soft_floor = true}));
  ASSERT_TRUE(world);
  step_until(*world, 0.5);
  Vec3 sum = Vec3::Zero();
  double greatest = 0.0;
  for (const OrganContact& contact : world->all<OrganContact>()) {
    Vec3 own = Vec3::Zero();
    for (const Vec3& force : contact.solution.forces) own += force;
    sum += own;
    greatest = std::max(greatest, own.norm());
  }
  EXPECT_GT(greatest, 0.1);
  EXPECT_LT(sum.norm(), 1e-9 * greatest);
}

TEST_P(Bedded, WhatOpenedALittleClosesToWhereItWas) {
  const double half_open = 0.5 * kLiftedBed.first();
  auto world = build(lifted_block({.response = GetParam(), .way = Vec3(0, 0, half_open)}));
  ASSERT_TRUE(world);
  const double area = bed_figures(*world)[0].area;
  const Lifted lifted = lift(*world, 2.0);
  EXPECT_EQ(bed_figures(*world)[0].whole, bed_figures(*world)[0].bonds);
  EXPECT_EQ(bed_figures(*world)[0].work, 0.0);
  EXPECT_NEAR(lifted.work, 0.0, 1e-3 * kLiftedBed.toughness * area);
  EXPECT_LT(pull_of_bed(*world).norm(), 0.01 * lifted.greatest);
}

TEST_P(Bedded, ASavedStateGoesOnToTheSameBits) {
  auto world = build(lifted_block({.response = GetParam(), .soft_floor = true}));
  ASSERT_TRUE(world);
  step_until(*world, 0.6);
  const BedFigures bed = bed_figures(*world)[0];
  ASSERT_GT(bed.work, 0.0);
  ASSERT_GT(bed.whole, 0u);
  expect_same_from_saved(*world, 0.9);
}
INSTANTIATE_TEST_SUITE_P(Responses, Bedded, testing::Values(Response::kLinear, Response::kFinite),
                         kByResponse);

TEST(Beds, OfOrgansThatNothingMovesTakeNoPart) {
  auto world = build(lifted_block({.way = Vec3::Zero(), .soft_floor = true}));
  ASSERT_TRUE(world);
  EXPECT_EQ(step_until(*world, 0.2), FlagSet());
  EXPECT_EQ(world->one<TouchingFigures>()->solves, 0u);
  for (const OrganContact& contact : world->all<OrganContact>()) EXPECT_TRUE(contact.cells.empty());
}

TEST(Beds, PartWhereAHookHeatsTheirEnds) {
  auto scene = lifted_block({.way = Vec3::Zero()});
  // Beside the block, low on its side.
  const Vec3 beside(14e-3, 0, -2.5e-3);
  auto hook = straight_tool("hook", InstrumentKind::kHook, 1e-3,
                            {{0.0, beside, 0.0, 1.0},
                             {0.2, beside - Vec3(3.2e-3, 0, 0), 40.0, 1.0},
                             {2.0, beside - Vec3(3.2e-3, 0, 0), 40.0, 1.0}});
  scene.instruments = {hook};
  auto world = build(scene);
  ASSERT_TRUE(world);
  step_until(*world, 2.0);
  const BedFigures bed = bed_figures(*world)[0];
  EXPECT_GT(bed.by_heat, 0u);
  EXPECT_LT(bed.by_heat, bed.bonds / 4);
  EXPECT_EQ(bed.by_force, 0u);
  const Bed& places = world->all<Bed>()[0];
  const BondStates& bonds = world->all<BedState>()[0].bonds;
  for (std::size_t b = 0; b < bonds.parted_by.size(); ++b)
    if (bonds.parted_by[b]) {
      EXPECT_LT((places.places.ends[0][b] - Vec3(10e-3, 0, -4e-3)).norm(), 5e-3);
    }
}

/// Of all the organ, in an instant [K].
void warm_all(Bioheat& heat, double by) {
  for (int z = -3; z < 3; ++z)
    for (int y = -6; y < 6; ++y)
      for (int x = -6; x < 6; ++x)
        if (HeatBrick* brick = heat.bricks().warm_up(BrickIndex(x, y, z)))
          brick->warm->excess.fill(static_cast<float>(by));
}

TEST(Beds, CarryHeatByTheirAreaTheGapAndTheTissuesConductivity) {
  auto scene = lifted_block({.way = Vec3::Zero(), .soft_floor = true});
  // So that heat is followed, much later.
  const Vec3 beside(14e-3, 0, -2e-3);
  scene.instruments = {
      straight_tool("hook", InstrumentKind::kHook, 1e-3,
                    {{0.0, beside, 0.0, 1.0}, {8.0, beside, 6.0, 1.0}, {9.0, beside, 0.0, 1.0}})};
  auto world = build(scene);
  ASSERT_TRUE(world);
  OrganBurn* block = world->find<OrganBurn>(world->model().organs()[0]);
  OrganBurn* floor = world->find<OrganBurn>(world->model().organs()[1]);
  ASSERT_TRUE(block && floor);
  constexpr double kWarm = 10.0;  // [K]
  Trace trace(stage_names());
  // A step finds which bricks are warm.
  for (int time = 0; time < 2; ++time) {
    if (time == 1) step_frame(*world, trace);
    warm_all(block->heat, kWarm);
  }
  block->heat.begin_book();
  floor->heat.begin_book();
  const double begun = world->time();
  step_frame(*world, trace);
  // They lie on each other: between the middles of both sides' voxels is one voxel.
  const double conductivity = block->heat.tissue().conductivity;
  const double exact = conductivity * bed_figures(*world)[0].area / block->heat.options().voxel *
                       kWarm * (world->time() - begun);
  EXPECT_NEAR(floor->heat.book().delivered, exact, 0.15 * exact);
  EXPECT_NEAR(block->heat.book().delivered, -floor->heat.book().delivered, 1e-4 * exact);
}

TEST(Beds, CarryHeatToTheOrganThatTheyHold) {
  auto scene = lifted_block({.way = Vec3::Zero(), .soft_floor = true});
  // On the block's side, so low that what it warms lies on the bed.
  const Vec3 beside(14e-3, 0, -2e-3);
  scene.instruments = {straight_tool("hook", InstrumentKind::kHook, 1e-3,
                                     {{0.0, beside, 0.0, 1.0},
                                      {0.2, beside - Vec3(3.2e-3, 0, 0), 6.0, 1.0},
                                      {2.0, beside - Vec3(3.2e-3, 0, 0), 6.0, 1.0}})};
  auto world = build(scene);
  ASSERT_TRUE(world);
  step_until(*world, 2.0);
  ASSERT_GT(bed_figures(*world)[0].whole, bed_figures(*world)[0].bonds / 2);
  OrganBurn* block = world->find<OrganBurn>(world->model().organs()[0]);
  OrganBurn* floor = world->find<OrganBurn>(world->model().organs()[1]);
  ASSERT_TRUE(block && floor);
  const double gone = floor->heat.book().delivered;
  EXPECT_GT(gone, 0.002 * block->heat.book().delivered);
  EXPECT_GT(floor->heat.greatest_excess(), 1.0);
  EXPECT_LT(floor->heat.greatest_excess(), block->heat.greatest_excess());
  // What the block lost by it the generator has given.
  const CauteryFigures all = *cautery_figures(*world);
  EXPECT_NEAR(all.generated, all.delivered + all.body + all.metal + all.gas, 1e-4 * all.generated);
  EXPECT_LT(std::abs(all.residual), 1e-3);
}

TEST(Beds, PartWhereTheMetalOfAHookTouchesThemWithCurrentAlone) {
  for (const double power : {0.0, 30.0}) {
    auto scene = lifted_block({.way = Vec3::Zero()});
    // At the edge, where it touches the outermost bonds and hardly the block.
    const Vec3 edge(10.8e-3, 0, -4.3e-3);
    scene.instruments = {straight_tool("hook", InstrumentKind::kHook, 1e-3,
                                       {{0.0, edge + Vec3(3e-3, 0, 5e-3), 0.0, 1.0},
                                        {0.15, edge, power, 1.0},
                                        {0.2, edge, power, 1.0}})};
    // So that heat is followed all the same.
    scene.instruments[0].path.push_back({9.0, edge + Vec3(9e-3, 0, 5e-3), 30.0, 1.0});
    if (power == 0.0)
      scene.instruments[0].path.insert(scene.instruments[0].path.end() - 1,
                                       {8.9, edge + Vec3(9e-3, 0, 5e-3), 0.0, 1.0});
    auto world = build(scene);
    ASSERT_TRUE(world);
    step_until(*world, 0.2);
    const BedFigures bed = bed_figures(*world)[0];
    EXPECT_EQ(bed.by_heat > 0, power > 0.0);
    EXPECT_LT(bed.by_heat, 10u);
    EXPECT_EQ(bed.by_force, 0u);
  }
}

TEST(Beds, AStateThatFitsNoBedIsTakenAsAWholeOne) {
  auto world = build(lifted_block({}));
  ASSERT_TRUE(world);
  step_until(*world, 0.6);
  BedState& state = world->all<BedState>()[0];
  state.bonds.opened.pop_back();
  state.forces.clear();
  const auto bytes = world->save_state();
  auto other = start_world(world->shared_model());
  ASSERT_TRUE(other);
  ASSERT_TRUE((*other)->load_state(bytes));
  const BedFigures bed = bed_figures(**other)[0];
  EXPECT_EQ(bed.whole, bed.bonds);
  step_until(**other, 0.7);
}

std::string refusal_of(const SceneDescription& scene) {
  std::vector<std::string> warnings;
  const auto world =
      build_world(scene, test_tissues(), {project_file("assets"), false}, no_progress(), warnings);
  return world ? "" : world.error().text();
}

TEST(Beds, WhereNoSurfacesFaceEachOtherAreRefusedWithTheirDistance) {
  auto scene = lifted_block({});
  scene.organs[0].pose.position.z() += 3e-3;
  const std::string far = refusal_of(scene);
  EXPECT_NE(far.find("beds/0/region: found none nearer than 3.0 mm"), std::string::npos) << far;
  BedDescriptions beds = *scene.extras.find<BedDescriptions>();
  beds[0].region.a = Vec3::Constant(0.1);
  beds[0].region.b = Vec3::Constant(0.2);
  scene.extras.set(beds);
  const std::string nowhere = refusal_of(scene);
  EXPECT_NE(nowhere.find("found no surface of \"block\""), std::string::npos) << nowhere;
}

}  // namespace
}  // namespace viscera::test
