// Hands on an organ that is cut.
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <thread>

#include "engine/features/held_tools/held_tools.h"
#include "engine/features/parting/parting.h"
#include "engine/simulator/build.h"
#include "tests/support/cutting.h"
#include "tests/support/held_world.h"

namespace viscera::test {
namespace {

const Vec3 kSlab(40e-3, 16e-3, 12e-3);
constexpr double kTopOfSlab = 6e-3, kProbeTip = 3e-3, kPressedIn = 1e-3;
constexpr double kCutDeep = 8e-3, kBladeWidth = 0.8e-3;
constexpr double kToughness = 150.0;  // of test_tissues() [J/m2]

/// A slab whose ends are held, and a scalpel upright that goes across it.
SceneDescription slab_to_cut(double begins, double along) {
  SceneDescription scene = held_bar_scene(kSlab, 2e-3, 8e-3, 4.2e-3, 4.2e-3);
  Region right;
  right.a = Vec3(0.5 * kSlab.x() - 8e-3, 0, 0);
  right.b = -Vec3::UnitX();
  scene.organs[0].fixed.push_back(right);
  scene.organs[0].response = Response::kFinite;
  scene.organs[0].extras.set(CuttableDescription{0.4e-3});
  scene.duration = 6.0;
  const Vec3 start(along, 12e-3, kTopOfSlab - kCutDeep), end(along, -12e-3, start.z());
  InstrumentDescription scalpel =
      upright_scalpel(start, end, begins, begins + 0.8, {16e-3, kBladeWidth});
  scalpel.path.push_back({6.0, end, 0.0, 1.0});  // a hand would begin its path again
  scene.instruments = {scalpel};
  return scene;
}

/// A hand presses the slab beside where it is cut.
SceneDescription pressed_while_cut(double beside = 4e-3) {
  SceneDescription scene = slab_to_cut(1.7, 0.0);
  const Vec3 above(beside, 0, kTopOfSlab + kProbeTip + 2e-3),
      pressed(beside, 0, kTopOfSlab + kProbeTip - kPressedIn);
  InstrumentDescription probe =
      straight_tool("probe", InstrumentKind::kProbe, kProbeTip,
                    {{0.6, above, 0.0, 1.0}, {1.0, pressed, 0.0, 1.0}, {6.0, pressed, 0.0, 1.0}});
  probe.extras.get<HapticDescription>().grip = HapticDescription::Grip::kFirm;
  scene.instruments.push_back(probe);
  return scene;
}

/// The scalpel in a hand.
SceneDescription cut_by_hand() {
  SceneDescription scene = slab_to_cut(0.8, 6e-3);
  scene.instruments[0].extras.get<HapticDescription>().grip = HapticDescription::Grip::kFirm;
  return scene;
}

const HapticTool& hand_of(const World& world) {
  return servos_of(world)->tools().front();
}
std::uint64_t bodies_of(const World& world) {
  return world.all<OrganCut>()[0].bodies;
}
bool all_cut(const World& world) {
  const OrganCut& cut = world.all<OrganCut>()[0];
  return cut.bodies > 0 && !cut.pending && !cut.changed;
}

/// A hand that presses so far from the middle of the cut.
struct Pressed {
  double whole = 0.0, cut = 0.0;  ///< what it feels [N]
  double agreement = 0.0;         ///< with the frame, once cut, as Agreement::ratio()
  std::uint64_t uncovered = 0;    ///< ticks without a hive
};
Pressed pressed_beside_cut(double beside) {
  Pressed pressed;
  const auto world = in_hand(pressed_while_cut(beside));
  if (!world) return pressed;
  step_until(*world, 1.65);
  pressed.whole = hand_of(*world).output.tissue.z();
  EXPECT_EQ(hand_of(*world).tissue->figures().uncovered, 0u);
  while (!all_cut(*world) && world->time() < 5.0) step_until(*world, world->time() + 0.01);
  EXPECT_TRUE(all_cut(*world));
  step_until(*world, world->time() + 0.8);  // the slab has swung
  const Agreement before = hand_of(*world).agreement;
  step_until(*world, world->time() + 0.5);
  const Agreement& after = hand_of(*world).agreement;
  EXPECT_GT(after.frames, before.frames + 20);
  pressed.cut = hand_of(*world).output.tissue.z();
  pressed.agreement =
      std::sqrt((after.difference - before.difference) / (after.felt - before.felt));
  pressed.uncovered = hand_of(*world).tissue->figures().uncovered;
  EXPECT_EQ(hand_of(*world).servo->passivity_violations(), 0u);
  EXPECT_EQ(hand_of(*world).events.size(), 1u) << "but that the device was met";
  return pressed;
}

TEST(CutHand, FeelsTheBodyThatTheOrganHasBecomeAsTheFrameDoes) {
  const Pressed pressed = pressed_beside_cut(5e-3);
  EXPECT_GT(pressed.whole, 0.01);
  EXPECT_LT(pressed.cut, 0.95 * pressed.whole);
  EXPECT_LT(pressed.agreement, 0.03);
  EXPECT_EQ(pressed.uncovered, 0u);
}

TEST(CutHand, FeelsACutsWallByASmallerHiveWithinATenth) {
  const Pressed pressed = pressed_beside_cut(2.2e-3);
  EXPECT_LT(pressed.agreement, 0.1);
  EXPECT_EQ(pressed.uncovered, 0u);
}

TEST(CutHand, FeelsTheFramesForceOverTheEdgeOfACut) {
  const Pressed pressed = pressed_beside_cut(1.2e-3);
  EXPECT_LT(pressed.cut, 0.9 * pressed.whole);
  EXPECT_GT(pressed.cut, 0.6 * pressed.whole);
  EXPECT_LT(pressed.agreement, 0.02);
}

TEST(CutHand, IsNotStruckAsTheOrganBecomesAnotherBody) {
  const auto world = in_hand(pressed_while_cut());
  ASSERT_TRUE(world);
  step_until(*world, 1.65);
  const double whole = hand_of(*world).output.tissue.z();
  double last = whole;
  std::uint64_t bodies = 0;
  while (!all_cut(*world) && world->time() < 5.0) {
    step_until(*world, world->time() + 1e-3);
    const double now = hand_of(*world).output.tissue.z();
    EXPECT_NEAR(now, last, 0.15 * whole) << world->time();
    last = now;
    bodies = bodies_of(*world);
  }
  EXPECT_GE(bodies, 1u);
}

TEST(CutHand, GoesOnFromACheckpointOnTheBodyThatItWasOn) {
  const SceneDescription scene = pressed_while_cut();
  const auto one = in_hand(scene);
  ASSERT_TRUE(one);
  while (bodies_of(*one) == 0 && one->time() < 5.0) step_until(*one, one->time() + 0.01);
  ASSERT_GT(bodies_of(*one), 0u);
  const auto bytes = one->save_state();
  const auto other = in_hand(scene);
  ASSERT_TRUE(other);
  const auto loaded = other->load_state(bytes);
  ASSERT_TRUE(loaded) << loaded.error().text();
  EXPECT_EQ(one->state_difference(*other), "");
  for (World* world : {one.get(), other.get()}) step_until(*world, world->time() + 0.2);
  EXPECT_EQ(one->state_difference(*other), "");
  // And back to the whole one.
  const auto fresh = in_hand(scene);
  ASSERT_TRUE(fresh);
  const auto whole = fresh->save_state();
  ASSERT_TRUE(other->load_state(whole));
  EXPECT_EQ(fresh->state_difference(*other), "");
  for (World* world : {fresh.get(), other.get()}) step_until(*world, 1.2);
  EXPECT_EQ(fresh->state_difference(*other), "");
}

TEST(CutHand, OnTheWallClockTakesTheNewBodyOverWithoutWaiting) {
  const auto world = in_hand(pressed_while_cut(), {ServoClock::kRealTime, 10.0, false});
  ASSERT_TRUE(world);
  while (!all_cut(*world) && world->time() < 5.0) step_until(*world, world->time() + 0.01);
  ASSERT_TRUE(all_cut(*world));
  std::this_thread::sleep_for(std::chrono::milliseconds(50));  // of ticks
  servos_of(*world)->stop();
  EXPECT_TRUE(hand_of(*world).tissue->organs[0].on_newest());
}

TEST(CutHand, AScalpelInItFeelsTheFractureEnergyOfWhatItParts) {
  const auto world = in_hand(cut_by_hand());
  ASSERT_TRUE(world);
  double work = 0.0;  // of the hand, on the tissue
  Vec3 before = hand_of(*world).output.tool.position;
  double greatest = 0.0;
  while (world->time() < 2.5) {
    step_until(*world, world->time() + 1e-3);
    const ServoOutput& output = hand_of(*world).output;
    work -= output.tissue.dot(output.tool.position - before);
    before = output.tool.position;
    greatest = std::max(greatest, output.tissue.norm());
  }
  const double area = world->all<OrganCut>()[0].area;
  EXPECT_NEAR(area, kCutDeep * kSlab.y(), 0.1 * kCutDeep * kSlab.y());
  EXPECT_NEAR(work, kToughness * area, 0.1 * kToughness * area);
  EXPECT_NEAR(greatest, kToughness * kCutDeep, 0.1 * kToughness * kCutDeep);
  EXPECT_EQ(hand_of(*world).servo->passivity_violations(), 0u);
  // It pushes nothing with its tip, and feels nothing once it is through.
  EXPECT_LT(hand_of(*world).output.tissue.norm(), 0.01);
}

}  // namespace
}  // namespace viscera::test
