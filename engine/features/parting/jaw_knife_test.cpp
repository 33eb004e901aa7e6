// A knife that runs between sealing jaws, across a strip that is held at its left end.
#include "engine/features/parting/jaw_knife.h"

#include <gtest/gtest.h>

#include <array>

#include "engine/features/cautery/bipolar.h"
#include "engine/features/clips/clips.h"
#include "engine/features/jaws/jaws.h"
#include "engine/features/parting/parting.h"
#include "engine/simulator/build.h"
#include "kernels/finite/finite_solver.h"
#include "kernels/points/closed_pieces.h"
#include "tests/support/paths.h"
#include "tests/support/small_world.h"

namespace viscera::test {
namespace {

const Vec3 kStrip(50e-3, 8e-3, 5e-3);      // about the origin [m]
constexpr double kStripRounding = 1.5e-3;  // of its edges [m]
constexpr double kKnifeWay = 12e-3;        // from beyond one side of the strip beyond the other [m]
constexpr double kPulled = 0.6;            // the trigger, from then on [s]
/// Of the strip between its rounded edges [m2].
constexpr double kSection = 8e-3 * 5e-3 - 0.8584 * kStripRounding * kStripRounding;

/// Jaws come from the strip's side and close as far as `jaw` over it; then the trigger is pulled
/// until `released`, or not at all. With `power`, current flows first.
SceneDescription strip_to_part(double jaw, bool pulled, double released = 20.0,
                               double power = 0.0) {
  SceneDescription scene = held_bar_scene(kStrip, kStripRounding, 10e-3, 3e-3, 3e-3);
  scene.organs[0].response = Response::kFinite;
  scene.organs[0].extras.set(CuttableDescription{0.4e-3});
  scene.duration = 12.0;
  const Vec3 away(10e-3, 40e-3, 0), at(10e-3, -5.5e-3, 0);
  InstrumentDescription sealer =
      straight_tool("sealer", InstrumentKind::kGrasper, 2e-3,
                    {{0.0, away, 0.0, 1.0}, {0.4, at, 0.0, 1.0}, {0.5, at, 0.0, jaw}});
  const double begins = power > 0.0 ? kPulled + 1.8 : kPulled;
  if (power > 0.0) {
    sealer.path.push_back({kPulled, at, power, jaw});
    sealer.path.push_back({kPulled + 1.7, at, 0.0, jaw});
  }
  sealer.path.push_back({begins, at, 0.0, jaw, pulled});
  sealer.path.push_back({released, at, 0.0, jaw, false});
  sealer.trocar = Vec3(10e-3, 0.25, 0);
  sealer.grip_radius = 9e-3;
  set_jaws(sealer, {0.6, kTeethFriction, {}});
  sealer.extras.set(BipolarDescription{48e3, kKnifeWay});
  scene.instruments = {sealer};
  return scene;
}

const OrganCut& parted(const World& world) {
  return world.all<OrganCut>()[0];
}
double travel_in(const World& world) {
  return world.all<JawKnife>()[0].travel;
}

TEST(JawKnife, PartsTheStripThatItsJawsHoldAndPullsNothingAtTheTip) {
  const auto cut = build(strip_to_part(0.0, true)), spared = build(strip_to_part(0.0, false));
  ASSERT_TRUE(cut && spared);
  // Half way through the two are the same body yet.
  step_until(*cut, kPulled + 0.15);
  step_until(*spared, kPulled + 0.15);
  ASSERT_EQ(parted(*cut).bodies, 0u);
  EXPECT_GT(parted(*cut).area, 0.2 * kSection);
  EXPECT_EQ((force_on(*cut, 0) - force_on(*spared, 0)).norm(), 0.0)
      << "what holds the knife, its own handle feels";
  EXPECT_TRUE(parted(*spared).gone.untouched());
  EXPECT_EQ(travel_in(*spared), 0.0);
  step_until(*cut, kPulled + 0.4);
  EXPECT_EQ(travel_in(*cut), 1.0);
  // Sides of the kerf meet the strip's roundings; squeezed tissue is found again at rest to a part
  // of a voxel at either face.
  EXPECT_NEAR(parted(*cut).area, kSection, 0.2 * kSection);
  EXPECT_GT(parted(*cut).work, 0.0);
  step_until(*cut, 3.2);
  EXPECT_EQ(parted(*cut).refused, 0u) << cut->all<OrganLeft>()[0].refusal;
  const OrganModel& body = *cut->all<OrganBody>()[0].model;
  EXPECT_EQ(closed_pieces(body.surface).size(), 2u) << parted(*cut).bodies << " bodies";
  EXPECT_EQ(body.finite->loose().pieces().size(), 1u);
  EXPECT_TRUE(cut->all<InstrumentContact>()[0].grasp) << "the jaws hold on";
}

TEST(JawKnife, OpenJawsCannotRunIt) {
  const auto world = build(strip_to_part(1.0, true));
  ASSERT_TRUE(world);
  step_until(*world, 1.2);
  EXPECT_EQ(travel_in(*world), 0.0);
  EXPECT_TRUE(parted(*world).gone.untouched());
}

TEST(JawKnife, RunsInThreeTenthsOfASecondAndBackAsTheTriggerIsReleasedOrTheJawsOpen) {
  constexpr double kBack = 1.2, kFrame = 1.0 / 60.0;
  SceneDescription released = strip_to_part(0.0, true, kBack);
  SceneDescription opened = strip_to_part(0.0, true);
  const Vec3 at = opened.instruments[0].path.back().tip;
  opened.instruments[0].path.back() = {kBack, at, 0.0, 0.0, true};
  opened.instruments[0].path.push_back({kBack + 0.02, at, 0.0, 1.0, true});
  for (const SceneDescription& scene : {released, opened}) {
    const auto world = build(scene);
    ASSERT_TRUE(world);
    step_until(*world, kPulled + 0.15);
    EXPECT_NEAR(travel_in(*world), 0.5, 1.5 * kFrame / 0.3);
    step_until(*world, kBack - 0.02);
    EXPECT_EQ(travel_in(*world), 1.0);
    const double area = parted(*world).area;
    EXPECT_GT(area, 0.0);
    step_until(*world, kBack + 0.15);
    EXPECT_GT(travel_in(*world), 0.3);
    EXPECT_LT(travel_in(*world), 0.7);
    step_until(*world, kBack + 0.5);
    EXPECT_EQ(travel_in(*world), 0.0);
    EXPECT_EQ(parted(*world).area, area) << "its back is blunt";
  }
}

TEST(JawKnife, AProgramMayPullTheTriggerAndASnapshotGoesOnAsItRuns) {
  const Model model = build_shared(strip_to_part(0.0, false));
  const auto step = [](Simulation& simulation) {
    Controls controls = simulation.path_controls();
    controls.tools[0].blade = simulation.time() > kPulled;
    ASSERT_TRUE(simulation.step(controls));
  };
  auto one = Simulation::create(model), other = Simulation::create(model);
  ASSERT_TRUE(one && other);
  while (one->time() < kPulled + 0.15) step(*one);
  EXPECT_GT(travel_in(one->world()), 0.3);
  EXPECT_GT(parted(one->world()).area, 0.0);
  const auto restored = other->restore(*one->snapshot());
  ASSERT_TRUE(restored) << restored.error().text();
  for (Simulation* simulation : {&*one, &*other})
    while (simulation->time() < kPulled + 0.4) step(*simulation);
  EXPECT_EQ(one->hash(), other->hash()) << one->world().state_difference(other->world());
}

TEST(JawKnife, ASealThatItsOwnKnifeCutsClosesTheDuctOnBothSides) {
  for (const auto& [power, open] : {std::pair(200.0, false), std::pair(1.0, true)}) {
    SceneDescription scene = strip_to_part(0.0, true, 20.0, power);
    scene.organs[0].extras.set(DuctsDescription{
        {{"artery", {Vec3(-20e-3, 0, 0), Vec3(20e-3, 0, 0)}, 13e3, DuctDescription::Fed::kBoth}}});
    const auto world = build(scene);
    ASSERT_TRUE(world);
    step_until(*world, kPulled + 2.2);
    const DuctFigures duct = duct_figures(*world).at(0);
    EXPECT_TRUE(duct.cut) << parted(*world).area << " m2";
    ASSERT_EQ(world->all<Sealer>()[0].seals.size(), 1u);
    EXPECT_EQ(duct.open, open) << power << " W, coagulated "
                               << world->all<Sealer>()[0].seals[0].coagulated;
  }
}

std::string refusal_of_knife(const SceneDescription& scene) {
  std::vector<std::string> warnings;
  const auto model =
      build_model(scene, test_tissues(), {project_file("assets"), false}, no_progress(), warnings);
  return model ? "" : model.error().text();
}

TEST(JawKnife, OneWithNothingToCutAndOneThatStaysAwayAreNamed) {
  SceneDescription scene = strip_to_part(0.0, true);
  scene.organs[0].extras.remove<CuttableDescription>();
  EXPECT_NE(refusal_of_knife(scene).find("instruments/0/bipolar/blade_mm: found 12, expected an "
                                         "organ with \"cuttable\""),
            std::string::npos)
      << refusal_of_knife(scene);
  scene = strip_to_part(0.0, true);
  for (InstrumentKey& key : scene.instruments[0].path) key.tip.x() += 70e-3;
  EXPECT_NE(refusal_of_knife(scene).find("instruments/0/path: found a blade that stays"),
            std::string::npos)
      << refusal_of_knife(scene);
  // Whose trigger nobody pulls only seals.
  scene.instruments[0].path = strip_to_part(0.0, false).instruments[0].path;
  for (InstrumentKey& key : scene.instruments[0].path) key.tip.x() += 70e-3;
  EXPECT_EQ(refusal_of_knife(scene), "");
}

}  // namespace
}  // namespace viscera::test
