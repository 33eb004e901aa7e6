// A blade that is drawn across a block which its ends pull at.
#include "engine/features/parting/parting.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numbers>

#include "engine/features/breathing/breathing_keys.h"
#include "engine/features/links/links_keys.h"
#include "engine/features/touching/touching_keys.h"
#include "engine/simulator/build.h"
#include "kernels/points/surface_checks.h"
#include "tests/support/cutting.h"
#include "tests/support/paths.h"
#include "tests/support/same_runs.h"
#include "tests/support/small_world.h"

namespace viscera::test {
namespace {

constexpr double kTop = 8e-3, kWide = 16e-3, kLong = 36e-3;  // of the block [m]
constexpr double kDeep = 5e-3;                               // the blade goes below its top [m]
constexpr double kBeyond = 4e-3;                             // ... and over both its sides [m]
constexpr double kBlade = 0.8e-3;                            // [m]
constexpr double kFracture = 150.0;                          // of test_tissues() [J/m2]
/// A blade that begins then is through the block a second later, and the block is cut soon after.
constexpr double kThrough = 1.0, kCut = 2.0;  // [s]

/// The block's ends are held, and go away from each other by `pulled` until 2.5 s, back until 5 s.
/// The scalpel stands upright, on a line along y at `along`.
SceneDescription block_to_cut(double deep, double begins, double pulled = 0.0, double along = 0.0,
                              double spacing = 4.2e-3) {
  SceneDescription scene =
      held_bar_scene({kLong, kWide, 2.0 * kTop}, 2e-3, 0.1e-3, spacing, spacing);
  OrganDescription& block = scene.organs[0];
  Region right;
  right.a = Vec3(0.5 * kLong - 0.1e-3, 0, 0);
  right.b = -Vec3::UnitX();
  block.fixed.push_back(right);
  if (pulled > 0.0)
    set_hold_motions(block, {{0, {0.5 * pulled, -Vec3::UnitX(), 5.0, 0.0}},
                             {1, {0.5 * pulled, Vec3::UnitX(), 5.0, 0.0}}});
  block.response = Response::kFinite;
  block.extras.set(CuttableDescription{0.4e-3});
  const double from = 0.5 * kWide + kBeyond;
  const Vec3 start(along, from, kTop - deep), end(along, -from, kTop - deep);
  scene.instruments = {upright_scalpel(start, end, begins, begins + kThrough, {12e-3, kBlade})};
  return scene;
}

const OrganCut& cut_of(const World& world) {
  return world.all<OrganCut>()[0];
}
const OrganModel& body_of(const World& world) {
  return *world.all<OrganBody>()[0].model;
}

/// At the top of the kerf's two walls, in the middle of the block, in the mean: how much farther
/// from each other they are than at rest [m].
double mouth_of(const World& world) {
  const OrganModel& body = body_of(world);
  double left = 0.0, right = 0.0;
  int left_count = 0, right_count = 0;
  for (std::size_t v = 0; v < body.surface.vertices.size(); ++v) {
    const Vec3& rest = body.surface.vertices[v];
    if (rest.z() < kTop - 1e-6 || std::abs(rest.y()) > 3e-3 || std::abs(rest.x()) > kBlade)
      continue;
    const double moved =
        static_cast<double>(world.all<OrganState>()[0].positions[v].x()) - rest.x();
    (rest.x() < 0.0 ? left : right) += moved;
    ++(rest.x() < 0.0 ? left_count : right_count);
  }
  return left_count > 0 && right_count > 0 ? right / right_count - left / left_count : 0.0;
}

TEST(Parting, ABladeLeavesAClosedSurfaceWithWallsAsDeepAsItWent) {
  const auto world = build(block_to_cut(kDeep, 0.01));
  ASSERT_TRUE(world);
  const TriangleSurface whole = body_of(*world).surface;
  EXPECT_EQ(step_until(*world, kCut), FlagSet());
  const OrganCut& cut = cut_of(*world);
  EXPECT_GE(cut.bodies, 1u);
  EXPECT_FALSE(cut.pending || cut.changed);
  const TriangleSurface& left = body_of(*world).surface;
  EXPECT_EQ(surface_defects(left), std::vector<std::string>());
  const double parted = kDeep * kWide;
  EXPECT_NEAR(volume(whole) - volume(left), kBlade * parted, 0.1 * kBlade * parted);
  EXPECT_NEAR(cut.area, parted, 0.1 * parted);
  const std::vector<float>& depths = world->all<OrganLeft>()[0].depths;
  ASSERT_EQ(depths.size(), left.vertices.size());
  EXPECT_NEAR(std::ranges::max(depths), kDeep + 0.5 * kBlade, 0.15e-3);
  EXPECT_EQ(world->all<OrganState>()[0].positions.size(), left.vertices.size());
}

TEST(Parting, ABladeCutsHoweverLittleItGoesInAStep) {
  SceneDescription scene = block_to_cut(kDeep, 0.01);
  // .005 mm a step, an eightieth of a voxel.
  constexpr double kWay = 0.6e-3, kGoes = 4.0;
  const Vec3 end(0.0, 0.5 * kWide - kWay, kTop - kDeep);
  scene.instruments = {
      upright_scalpel(end + Vec3(0.0, 2.0 * kWay, 0.0), end, 0.01, 0.01 + kGoes, {12e-3, kBlade})};
  const auto world = build(scene);
  ASSERT_TRUE(world);
  step_until(*world, 0.02 + kGoes);
  EXPECT_NEAR(cut_of(*world).area, kDeep * kWay, 0.25 * kDeep * kWay);
  EXPECT_GT(cut_of(*world).work, 0.0);
}

/// How far the tissue that lay so deep has sunk at a time while the block is pulled [m].
double sunk_by(double pulled, double time) {
  const auto world = build(block_to_cut(-5e-3, 0.01, pulled, 0.0, 3e-3));
  if (!world) return 0.0;
  step_until(*world, time);
  const std::vector<Vec3>& rest = body_of(*world).surface.vertices;
  const auto off = [](const Vec3& vertex) { return (vertex - Vec3(0, 0, kTop)).norm(); };
  const auto top = std::ranges::min_element(rest, {}, off) - rest.begin();
  const double sunk =
      rest[static_cast<std::size_t>(top)].z() -
      static_cast<double>(world->all<OrganState>()[0].positions[static_cast<std::size_t>(top)].z());
  return sunk * (kTop - kDeep) / kTop;
}

TEST(Parting, TissueThatIsPulledGapesAsWideCutAtRestAsCutWhileItIsPulled) {
  constexpr double kPulled = 3e-3;
  const auto first = build(block_to_cut(kDeep, 0.01, kPulled, 0.0, 3e-3));
  // Drawn out, the block is thinner: the blade goes where the same tissue is.
  const auto last = build(block_to_cut(kDeep + sunk_by(kPulled, 2.0), 2.0, kPulled, 0.0, 3e-3));
  ASSERT_TRUE(first && last);
  EXPECT_EQ(step_until(*first, 2.5), FlagSet());
  const double gape = mouth_of(*first);
  EXPECT_GT(gape, 0.4 * kPulled);
  // The ends are where they were, and so is the mouth; then they come again.
  step_until(*last, 5.0);
  EXPECT_GE(cut_of(*last).bodies, 1u);
  EXPECT_NEAR(mouth_of(*last), 0.0, 0.05e-3);
  step_until(*last, 7.5);
  EXPECT_NEAR(mouth_of(*last), gape, 0.1 * gape);
}

TEST(Parting, ABlockThatIsCutThroughComesApart) {
  constexpr double kPulled = 3e-3;
  SceneDescription scene = block_to_cut(2.0 * kTop + 1e-3, 0.01, kPulled);
  scene.instruments[0].extras.set(BladeDescription{22e-3, kBlade});
  const auto world = build(scene);
  ASSERT_TRUE(world);
  step_until(*world, 2.5);
  EXPECT_EQ(cut_of(*world).refused, 0u);
  // Its halves go with what holds them, as they are.
  EXPECT_NEAR(mouth_of(*world), kPulled, 0.02e-3);
  EXPECT_NEAR(cut_of(*world).area, kWide * 2.0 * kTop, 0.1 * kWide * 2.0 * kTop);
}

TEST(Parting, ScissorsCutAsTheyCloseAndNotAsTheyOpenOrMove) {
  SceneDescription scene = block_to_cut(kDeep, 0.01);
  constexpr double kJaws = 14e-3;
  // From above, with the block's top edge between the blades, which swing along y.
  const Vec3 at(0.0, 0.0, kTop - 4e-3);
  InstrumentDescription scissors = straight_tool("scissors", InstrumentKind::kScissors, 0.5e-3,
                                                 {{0.0, Vec3(0, 0, kTop + 4e-3), 0.0, 0.0},
                                                  {0.2, Vec3(0, 0, kTop + 4e-3), 0.0, 1.0},
                                                  {0.4, at, 0.0, 1.0},
                                                  {0.5, at, 0.0, 1.0},
                                                  {0.7, at, 0.0, 0.0}});
  scissors.trocar = Vec3(0.0, 0.0, 20.0);
  scissors.roll = std::numbers::pi / 2.0;
  scissors.extras.set(BladeDescription{kJaws, kBlade});
  scene.instruments = {scissors};
  const auto world = build(scene);
  ASSERT_TRUE(world);
  step_until(*world, 0.49);
  EXPECT_TRUE(cut_of(*world).gone.untouched());
  step_until(*world, 0.8);
  // A sector less the part above the block: half the angle on either side of the axis.
  const double tan = std::tan(kScissorsOpen), above = kJaws - 4e-3;
  const double sector = kScissorsOpen * kJaws * kJaws - tan * above * above;
  // Where both blades meet, each finds what the other's width has parted.
  EXPECT_LT(cut_of(*world).area, sector);
  EXPECT_GT(cut_of(*world).area, sector - kBlade * kJaws);
}

TEST(Parting, WhatMovesGoesOnMovingAsTheBodyBecomesAnother) {
  // A cut through one corner of the top: hardly anything is softer by it.
  const auto cut = build(block_to_cut(1e-3, 0.01, 3e-3, -12e-3));
  const auto spared = build(block_to_cut(-2e-3, 0.01, 3e-3, -12e-3));
  ASSERT_TRUE(cut && spared);
  Trace trace(stage_names());
  double greatest = 0.0;
  const auto place = [](const World& world) {
    return world.all<OrganState>()[0].positions[0].cast<double>().eval();
  };
  while (cut->time() < 2.5) {
    step_frame(*cut, trace);
    step_frame(*spared, trace);
    greatest = std::max(greatest, (place(*cut) - place(*spared)).norm());
  }
  EXPECT_GE(cut_of(*cut).bodies, 1u);
  EXPECT_EQ(cut_of(*spared).bodies, 0u);
  EXPECT_LT(greatest, 0.03e-3);
}

TEST(Parting, TheForceOnABladeDoesTheWorkThatTheCutTakes) {
  const auto world = build(block_to_cut(kDeep, 0.01));
  ASSERT_TRUE(world);
  double work = 0.0;
  Trace trace(stage_names());
  Vec3 last = world->all<InstrumentState>()[0].tip;
  while (world->time() < 1.2) {
    step_frame(*world, trace);
    const Vec3 tip = world->all<InstrumentState>()[0].tip;
    work -= force_on(*world, 0).dot(tip - last);
    last = tip;
  }
  const double expected = kFracture * kDeep * kWide;
  EXPECT_NEAR(cut_of(*world).work, expected, 0.1 * expected);
  EXPECT_NEAR(work, cut_of(*world).work, 0.03 * expected);
}

TEST(Parting, ABladeThatGoesOverTissueCutsNothing) {
  const auto world = build(block_to_cut(-1e-3, 0.01));
  ASSERT_TRUE(world);
  EXPECT_EQ(step_until(*world, 1.5), FlagSet());
  EXPECT_TRUE(cut_of(*world).gone.untouched());
  EXPECT_EQ(cut_of(*world).bodies, 0u);
  EXPECT_EQ(force_on(*world, 0).norm(), 0.0);
}

TEST(Parting, ASimulationGoesOnFromASnapshotBeforeWhileAndAfterAnOrganIsCut) {
  const Model model = build_shared(block_to_cut(kDeep, 0.01, 2e-3));
  auto one = Simulation::create(model);
  ASSERT_TRUE(one);
  std::vector<Snapshot> snapshots;
  std::vector<std::string> hashes;
  for (const double time : {0.05, 0.5, 0.9, 1.3, 2.2}) {
    while (one->time() < time) one->step();
    snapshots.push_back(*one->snapshot());
    hashes.push_back(one->hash());
  }
  while (one->time() < 2.5) one->step();
  EXPECT_GE(cut_of(one->world()).bodies, 1u);
  auto other = Simulation::create(model);
  ASSERT_TRUE(other);
  for (const std::size_t i : {4, 1, 3, 0, 2}) {
    const auto restored = other->restore(snapshots[i]);
    ASSERT_TRUE(restored) << restored.error().text();
    EXPECT_EQ(other->hash(), hashes[i]) << i;
    while (other->time() < 2.5) other->step();
    EXPECT_EQ(other->hash(), one->hash())
        << "from " << i << ": " << other->world().state_difference(one->world());
  }
}

TEST(Parting, ARunIsTheSameOnAnyNumberOfThreads) {
  expect_same_runs(build_shared(block_to_cut(kDeep, 0.01, 2e-3)), {}, 2.2);
}

// --- what is refused ----------------------------------------------------------------------------

std::string refusal(const SceneDescription& scene) {
  std::vector<std::string> warnings;
  const auto model =
      build_model(scene, test_tissues(), {project_file("assets"), false}, no_progress(), warnings);
  return model ? "" : model.error().text();
}

TEST(Parting, ABladeThatStaysAwayFromAllThatItCouldCutIsNamed) {
  SceneDescription scene = block_to_cut(kDeep, 0.01);
  for (InstrumentKey& key : scene.instruments[0].path) key.tip.x() += 70e-3;
  EXPECT_NE(refusal(scene).find("instruments/0/path: found a blade that stays 52 mm from every "
                                "organ that is cuttable"),
            std::string::npos)
      << refusal(scene);
}

TEST(Parting, AScalpelWithoutAnOrganToCutAndAnOrganThatCannotBeAreNamed) {
  SceneDescription scene = block_to_cut(kDeep, 0.01);
  scene.organs[0].extras.remove<CuttableDescription>();
  EXPECT_NE(refusal(scene).find(
                "instruments: found a scalpel or scissors, expected an organ with \"cuttable\""),
            std::string::npos);
  scene = block_to_cut(kDeep, 0.01);
  scene.organs[0].response = Response::kLinear;
  EXPECT_NE(refusal(scene).find("organs/0/response: found linear for an organ that is cuttable"),
            std::string::npos);
  scene = block_to_cut(kDeep, 0.01);
  scene.organs[0].free = true;
  EXPECT_NE(refusal(scene).find("organs/0/free: found true for an organ that is cuttable"),
            std::string::npos);
  scene = block_to_cut(kDeep, 0.01);
  scene.organs.push_back(scene.organs[0]);
  scene.organs[1].name = "other";
  scene.extras.set(LinkDescriptions{{.name = "link", .between = {"other", scene.organs[0].name}}});
  EXPECT_NE(refusal(scene).find("links/0/between: found \"" + scene.organs[0].name +
                                "\", which is cuttable"),
            std::string::npos)
      << refusal(scene);
  scene = block_to_cut(kDeep, 0.01);
  TouchingDescription touching;
  touching.folds = true;
  scene.extras.set(touching);
  EXPECT_NE(refusal(scene).find("contact: found folds or shafts that touch"), std::string::npos);
}

}  // namespace
}  // namespace viscera::test
