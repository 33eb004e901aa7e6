// Jaws that seal a strip which is held at its left end.
#include "engine/features/cautery/bipolar.h"

#include <gtest/gtest.h>

#include <cmath>

#include "engine/features/clips/clips.h"
#include "engine/features/jaws/jaws.h"
#include "engine/features/parting/parting_keys.h"
#include "engine/simulator/build.h"
#include "tests/support/cutting.h"
#include "tests/support/small_world.h"

namespace viscera::test {
namespace {

const Vec3 kSealedBar(50e-3, 12e-3, 6e-3);
constexpr double kOn = 0.6, kOff = 6.0;  // [s]

/// Jaws come from the right, close about x = 10 mm, and carry so much power until `off`.
SceneDescription bar_to_seal(double power, double off = kOff) {
  SceneDescription scene = held_bar_scene(kSealedBar, 1.5e-3, 10e-3, 3e-3, 3e-3);
  scene.organs[0].response = Response::kFinite;
  scene.duration = 12.0;
  const Vec3 away(45e-3, 0, 0), at(10e-3, 0, 0);
  InstrumentDescription sealer = straight_tool("sealer", InstrumentKind::kGrasper, 2e-3,
                                               {{0.0, away, 0.0, 1.0},
                                                {0.3, at, 0.0, 1.0},
                                                {0.4, at, 0.0, 0.0},
                                                {kOn, at, power, 0.0},
                                                {off, at, 0.0, 0.0},
                                                {12.0, at, 0.0, 0.0}});
  sealer.trocar = Vec3(0.25, 0, 0);
  sealer.grip_radius = 6.5e-3;
  set_jaws(sealer, {6.0, kTeethFriction, {}});
  sealer.extras.set(BipolarDescription{});
  scene.instruments = {sealer};
  return scene;
}

const Sealer& sealer_in(const World& world) {
  return world.all<Sealer>()[0];
}

TEST(Bipolar, CoagulatesWhatItSqueezesAndEndsByItselfAsThatDries) {
  const auto world = build(bar_to_seal(200.0));
  ASSERT_TRUE(world);
  while (!sealer_in(*world).over && world->time() < kOff) step_until(*world, world->time() + 0.02);
  ASSERT_TRUE(sealer_in(*world).over);
  EXPECT_GT(world->time(), kOn + 0.3);
  EXPECT_TRUE(sealer_in(*world).seals.empty()) << "the handle still asks for current";
  const double generated = world->all<BurnTrace>()[0].book.generated;
  step_until(*world, kOff + 0.1);
  ASSERT_EQ(sealer_in(*world).seals.size(), 1u);
  const Seal& seal = sealer_in(*world).seals[0];
  EXPECT_TRUE(seal.dried);
  EXPECT_TRUE(seal.fused());
  EXPECT_LT(seal.squeezed, 0.9);
  EXPECT_GT(seal.last, 1.2 * seal.least);
  EXPECT_GT(world->all<OrganBurn>()[0].heat.vaporised_water(), 20e-6) << "some water has left";
  EXPECT_NEAR(seal.middle.x(), 10e-3, 2e-3);
  EXPECT_TRUE(seal.holds_within(Vec3(10e-3, 0, 0)));
  EXPECT_FALSE(seal.holds_within(Vec3(-10e-3, 0, 0)));
  EXPECT_EQ(world->all<BurnTrace>()[0].book.generated, generated) << "no current since it ended";
  const CauteryFigures figures = *cautery_figures(*world);
  EXPECT_NEAR(figures.generated, figures.delivered + figures.gas, 1e-4 * figures.generated);
  EXPECT_EQ(figures.body, 0.0);
  EXPECT_LT(std::abs(figures.residual), 1e-3);
  EXPECT_GT(world->all<BurnTrace>()[0].tip.excess(), 1.0) << "the jaws have become warm";
}

TEST(Bipolar, LeavesNoSealWhereCurrentEndsEarlyAndIsOpenOnNothing) {
  const auto early = build(bar_to_seal(120.0, kOn + 0.1));
  ASSERT_TRUE(early);
  step_until(*early, 1.0);
  ASSERT_EQ(sealer_in(*early).seals.size(), 1u);
  EXPECT_FALSE(sealer_in(*early).seals[0].fused());
  EXPECT_FALSE(sealer_in(*early).seals[0].dried);
  SceneDescription beside = bar_to_seal(120.0);
  for (InstrumentKey& key : beside.instruments[0].path) key.tip.x() += 40e-3;
  const auto nothing = build(beside);
  ASSERT_TRUE(nothing);
  step_until(*nothing, 1.0);
  ASSERT_EQ(nothing->all<BurnTrace>().size(), 1u);
  EXPECT_TRUE(nothing->all<BurnTrace>()[0].current.open);
  EXPECT_TRUE(sealer_in(*nothing).seals.empty());
}

/// A duct along the bar, fed from its held end, that a scalpel cuts where the jaws were.
SceneDescription bar_to_seal_and_cut(double power, double holds) {
  SceneDescription scene = bar_to_seal(power, 2.2);
  scene.organs[0].extras.set(CuttableDescription{0.4e-3});
  scene.organs[0].extras.set(DuctsDescription{
      {{"artery", {Vec3(-20e-3, 0, 0), Vec3(20e-3, 0, 0)}, 13e3, DuctDescription::Fed::kStart}}});
  InstrumentDescription& sealer = scene.instruments[0];
  sealer.extras.set(BipolarDescription{holds});
  sealer.path.pop_back();
  sealer.path.push_back({2.4, sealer.path[1].tip, 0.0, 1.0});
  sealer.path.push_back({2.6, sealer.path[0].tip, 0.0, 1.0});
  const Vec3 tip(10e-3, 12e-3, -8e-3);
  scene.instruments.push_back(
      upright_scalpel(tip, tip - Vec3(0, 24e-3, 0), 2.8, 3.0, {16e-3, 0.8e-3}));
  return scene;
}

TEST(Bipolar, ASealClosesADuctThatIsCutThroughIt) {
  for (const auto& [power, holds, open] :
       {std::tuple(200.0, 48e3, false), std::tuple(200.0, 10e3, true),
        std::tuple(1.0, 48e3, true)}) {
    const auto world = build(bar_to_seal_and_cut(power, holds));
    ASSERT_TRUE(world);
    step_until(*world, 3.1);
    const DuctFigures duct = duct_figures(*world).at(0);
    EXPECT_TRUE(duct.cut);
    EXPECT_EQ(duct.open, open) << power << " W, " << holds << " Pa";
  }
}

TEST(Bipolar, GoesOnFromASnapshotWithinACycle) {
  const SceneDescription scene = bar_to_seal(120.0);
  const auto one = build(scene), other = build(scene);
  ASSERT_TRUE(one && other);
  step_until(*one, kOn + 0.3);
  EXPECT_TRUE(sealer_in(*one).on);
  ASSERT_TRUE(other->load_state(one->save_state()));
  for (World* world : {one.get(), other.get()}) step_until(*world, kOn + 0.6);
  EXPECT_EQ(one->state_difference(*other), "");
}

}  // namespace
}  // namespace viscera::test
