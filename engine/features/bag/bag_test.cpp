// A bag that is held under what a blade cuts off.
#include "engine/features/bag/bag.h"

#include <gtest/gtest.h>

#include "engine/features/parting/parting_flags.h"
#include "engine/features/parting/remove_pieces.h"
#include "engine/simulator/build.h"
#include "kernels/finite/finite_solver.h"
#include "kernels/points/closed_pieces.h"
#include "tests/support/cutting.h"
#include "tests/support/small_world.h"

namespace viscera::test {
namespace {

// The piece is off by the first; what is kept is at the trocar by the second, gone by the third
// [s].
constexpr double kBagCloses = 1.7, kBagOut = 3.2, kBagGone = 4.8;
const BagDescription kSack{60e-3, 60e-3};

/// A grasper holds the end that a blade cuts off. A bag's sack hangs about it, its shaft along y;
/// its mouth closes, the grasper lets go, and the bag goes back to its trocar.
SceneDescription end_to_bag(double bore) {
  SceneDescription scene = bar_to_sever(Vec3::UnitZ(), Vec3(6e-3, 0, 0));
  const Vec3 above(12e-3, 0, 14e-3), on(12e-3, 0, 9.8e-3);
  InstrumentDescription grasper = straight_tool("grasper", InstrumentKind::kGrasper, 1.5e-3,
                                                {{0.0, above, 0.0, 1.0},
                                                 {0.05, on, 0.0, 1.0},
                                                 {0.1, on, 0.0, 0.0},
                                                 {kBagCloses + 0.15, on, 0.0, 0.0},
                                                 {kBagCloses + 0.2, on, 0.0, 1.0}});
  // The ring's middle lies 30 mm beyond the tip, above the end that is cut off.
  const Vec3 about(12e-3, 30e-3, 20e-3), out(12e-3, 92e-3, 20e-3);
  InstrumentDescription bag = straight_tool("bag", InstrumentKind::kBag, 1.5e-3,
                                            {{0.0, about, 0.0, 1.0},
                                             {kBagCloses, about, 0.0, 1.0},
                                             {kBagCloses + 0.1, about, 0.0, 0.0},
                                             {kBagCloses + 0.4, about, 0.0, 0.0},
                                             {kBagOut - 0.1, out, 0.0, 0.0}});
  bag.trocar = Vec3(12e-3, 100e-3, 20e-3);
  bag.extras.set(kSack);
  bag.extras.set(BoreDescription{bore});
  scene.instruments.push_back(grasper);
  scene.instruments.push_back(bag);
  return scene;
}

Entity bag_in(const World& world) {
  return world.model().instruments()[2];
}
bool keeps(const World& world) {
  return world.find<InstrumentContact>(bag_in(world))->grasp.has_value();
}
/// How far what hangs off the block's end has gone, in the mean, as it is drawn [m].
Vec3 piece_moved(const World& world) {
  const std::vector<int>& pieces = world.all<OrganLeft>()[0].pieces;
  const OrganModel& model = *world.all<OrganBody>()[0].model;
  Vec3 sum = Vec3::Zero();
  int count = 0;
  for (std::size_t v = 0; v < pieces.size(); ++v) {
    const Vec3& rest = model.surface.vertices[v];
    if (rest.x() < 6e-3) continue;
    sum += world.all<OrganState>()[0].positions[v].cast<double>() - rest;
    ++count;
  }
  return sum / std::max(count, 1);
}

TEST(Bag, ASackHangsFromTheWholeMouthAndNoHigher) {
  InstrumentState state;
  state.tip = Vec3(0, 30e-3, 0);
  state.shaft_direction = Vec3::UnitY();
  state.side_direction = -Vec3::UnitZ();
  EXPECT_TRUE(in_sack(kSack, state, Vec3(0, 0, -1e-3)));
  EXPECT_FALSE(in_sack(kSack, state, Vec3(0, 0, 1e-3))) << "above the mouth";
  EXPECT_TRUE(in_sack(kSack, state, Vec3(0, 0, -59e-3)));
  EXPECT_FALSE(in_sack(kSack, state, Vec3(0, 0, -61e-3))) << "below the sack";
  for (const Vec3& way : {Vec3(1, 0, 0), Vec3(-1, 0, 0), Vec3(0, 1, 0), Vec3(0, -1, 0)}) {
    EXPECT_TRUE(in_sack(kSack, state, 29e-3 * way - Vec3(0, 0, 0.1e-3)));
    EXPECT_FALSE(in_sack(kSack, state, 31e-3 * way - Vec3(0, 0, 0.1e-3)));
  }
}

TEST(Bag, APieceInTheSackIsKeptAsTheMouthClosesAndGoesWithTheBag) {
  const auto world = build(end_to_bag(3e-3));
  ASSERT_TRUE(world);
  step_until(*world, kBagCloses - 0.05);
  ASSERT_EQ(world->all<OrganBody>()[0].model->finite->loose().pieces().size(), 1u);
  EXPECT_FALSE(keeps(*world));
  const FlagSet flags = step_until(*world, kBagCloses + 0.35);
  EXPECT_FALSE(flags.has(kBagEmpty));
  ASSERT_TRUE(keeps(*world));
  EXPECT_EQ(world->find<Bag>(bag_in(*world))->kept, 1u);
  // The grasper has let go for .15 s: else it would have fallen by 110 mm.
  EXPECT_LT(piece_moved(*world).norm(), 1.5e-3) << piece_moved(*world).transpose();
  const FlagSet out = step_until(*world, kBagOut);
  // 16 mm is more than three times the bore.
  EXPECT_TRUE(out.has(kPieceStuck));
  EXPECT_TRUE(world->all<OrganCut>()[0].removed.empty());
  EXPECT_TRUE(keeps(*world));
  // As far as the tip.
  EXPECT_LT((piece_moved(*world) - Vec3(0, 62e-3, 0)).norm(), 2.5e-3)
      << piece_moved(*world).transpose();
}

TEST(Bag, WhatItKeepsLeavesThroughATrocarThatIsNarrowerThanThePiece) {
  const auto world = build(end_to_bag(12e-3));
  ASSERT_TRUE(world);
  const FlagSet flags = step_until(*world, kBagGone);
  EXPECT_FALSE(flags.has(kPieceStuck));
  EXPECT_FALSE(flags.has(kCutRefused)) << world->all<OrganLeft>()[0].refusal;
  ASSERT_EQ(world->all<OrganCut>()[0].removed_used, 1u);
  EXPECT_EQ(closed_pieces(world->all<OrganBody>()[0].model->surface).size(), 1u);
  EXPECT_FALSE(keeps(*world));
}

TEST(Bag, AMouthThatClosesOnNothingSaysSo) {
  SceneDescription scene = end_to_bag(12e-3);
  for (InstrumentKey& key : scene.instruments[2].path) key.tip.z() = -40e-3;
  const auto world = build(scene);
  ASSERT_TRUE(world);
  Trace trace(stage_names());
  int told = 0;
  while (world->time() < kBagCloses + 0.3)
    told += step_frame(*world, trace).flags.has(kBagEmpty) ? 1 : 0;
  EXPECT_EQ(told, 1);
  EXPECT_FALSE(keeps(*world));
}

TEST(Bag, AMouthThatOpensLetsGo) {
  SceneDescription scene = end_to_bag(12e-3);
  const Vec3 about = scene.instruments[2].path.front().tip;
  scene.instruments[2].path = {{0.0, about, 0.0, 1.0},
                               {kBagCloses, about, 0.0, 1.0},
                               {kBagCloses + 0.1, about, 0.0, 0.0},
                               {kBagCloses + 0.4, about, 0.0, 0.0},
                               {kBagCloses + 0.5, about, 0.0, 1.0}};
  const auto world = build(scene);
  ASSERT_TRUE(world);
  step_until(*world, kBagCloses + 0.35);
  ASSERT_TRUE(keeps(*world));
  step_until(*world, kBagCloses + 0.6);
  EXPECT_FALSE(keeps(*world));
}

TEST(Bag, ARunGoesOnFromASnapshotWhileABagKeepsAPiece) {
  const Model model = build_shared(end_to_bag(12e-3));
  auto one = Simulation::create(model), other = Simulation::create(model);
  ASSERT_TRUE(one && other);
  while (one->time() < kBagCloses + 0.3) one->step();
  ASSERT_TRUE(keeps(one->world()));
  const auto snapshot = one->snapshot();
  ASSERT_TRUE(snapshot) << snapshot.error().text();
  const double end = one->time() + 0.3;
  while (one->time() < end) one->step();
  const auto restored = other->restore(*snapshot);
  ASSERT_TRUE(restored) << restored.error().text();
  while (other->time() < end) other->step();
  EXPECT_EQ(other->hash(), one->hash()) << other->world().state_difference(one->world());
}

TEST(Bag, ABagWithoutAnOrganThatMayBeCutIsNamed) {
  SceneDescription scene = end_to_bag(12e-3);
  scene.organs[0].extras.remove<CuttableDescription>();
  scene.instruments.erase(scene.instruments.begin());  // the scalpel
  const auto checked = bag_feature().check(scene, {});
  ASSERT_FALSE(checked);
  EXPECT_NE(checked.error().text().find(
                "instruments/1/kind: found a bag, expected an organ with \"cuttable\""),
            std::string::npos)
      << checked.error().text();
}

}  // namespace
}  // namespace viscera::test
