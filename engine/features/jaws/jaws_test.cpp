#include "engine/features/jaws/jaws.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "engine/features/contact/contact.h"
#include "engine/simulator/build.h"
#include "engine/simulator/simulation.h"
#include "tests/support/small_world.h"

namespace viscera::test {
namespace {

const Vec3 kStrip(60e-3, 24e-3, 8e-3);  // held at its left end [m]
constexpr double kRadius = 5e-3, kJawsClosed = 0.4, kSettled = 1.0;

/// Jaws come from the right, close about the strip's right end, and go along x at `speed` [m/s].
SceneDescription pinched_strip(Response response, double force, double speed,
                               const std::vector<JawsDescription::Turn>& turns = {}) {
  SceneDescription scene = held_bar_scene(kStrip, 2e-3, 10e-3, 3e-3, 3e-3);
  scene.organs[0].response = response;
  scene.organs[0].youngs_modulus = 200e3;  // it bears to be pulled by what jaws hold
  scene.duration = 6.0;
  const Vec3 away(45e-3, 0, 0), at(26e-3, 0, 0);
  InstrumentDescription grasper =
      straight_tool("grasper", InstrumentKind::kGrasper, 2e-3,
                    {{0.0, away, 0.0, 1.0},
                     {0.3, at, 0.0, 1.0},
                     {kJawsClosed, at, 0.0, 0.0},
                     {kSettled, at, 0.0, 0.0},
                     {kSettled + 4.0, at + 4.0 * speed * Vec3::UnitX(), 0.0, 0.0}});
  grasper.trocar = Vec3(0.25, 0, 0);
  grasper.grip_radius = kRadius;
  set_jaws(grasper, {force, kTeethFriction, turns});
  scene.instruments = {grasper};
  return scene;
}

const Jaws& jaws_in(const World& world) {
  return world.all<Jaws>()[0];
}

double friction_on(const World& world) {
  const Vec3 force = force_on(world, 0), normal = jaws_in(world).normal;
  return (force - force.dot(normal) * normal).norm();
}

class ForcefulJaws : public testing::TestWithParam<std::tuple<Response, double>> {};
class JawsOn : public testing::TestWithParam<Response> {};

TEST_P(ForcefulJaws, SlipAtTwiceFrictionTimesForceAndRubWithThatWhileTheySlide) {
  const auto [response, force] = GetParam();
  auto world = build(pinched_strip(response, force, 8e-3));
  ASSERT_TRUE(world);
  step_until(*world, kSettled);
  ASSERT_GT(jaws_in(*world).upper, 3u);
  const double limit = 2.0 * kTeethFriction * force;
  double begins = 0.0, least = 1e9, most = 0.0, before = 0.0;
  int frames = 0;
  Trace trace(stage_names());
  while (world->time() < kSettled + 3.9 && jaws_in(*world).way < 4e-3) {
    step_frame(*world, trace);
    ASSERT_TRUE(world->all<InstrumentContact>()[0].grasp);
    const double friction = friction_on(*world);
    if (jaws_in(*world).sliding) {
      if (++frames == 1) begins = friction;
      least = std::min(least, friction);
      most = std::max(most, friction);
    } else if (frames == 0) {
      before = friction;
    }
  }
  RecordProperty("begins_N", std::to_string(begins));
  RecordProperty("least_N", std::to_string(least));
  RecordProperty("most_N", std::to_string(most));
  RecordProperty("retaken", std::to_string(jaws_in(*world).retaken));
  ASSERT_GT(frames, 10);
  EXPECT_GE(jaws_in(*world).retaken, 1u);
  EXPECT_LT(before, 1.001 * limit);
  EXPECT_GT(before, 0.8 * limit);  // it had held nearly as much
  EXPECT_NEAR(begins / limit, 1.0, 0.05);
  EXPECT_NEAR(least / limit, 1.0, 0.05);
  EXPECT_NEAR(most / limit, 1.0, 0.05);
}
INSTANTIATE_TEST_SUITE_P(Jaws, ForcefulJaws,
                         testing::Combine(testing::Values(Response::kLinear, Response::kFinite),
                                          testing::Values(1.0, 2.0, 4.0)));

TEST_P(JawsOn, SqueezeWithTheirForceFromBothSides) {
  auto world = build(pinched_strip(GetParam(), 2.0, 0.0));
  ASSERT_TRUE(world);
  EXPECT_FALSE(step_until(*world, 2.0).has(kJawsShut));
  const Jaws& jaws = jaws_in(*world);
  const double above = -jaws.presses[0].dot(jaws.normal), below = jaws.presses[1].dot(jaws.normal);
  RecordProperty("above_N", std::to_string(above));
  RecordProperty("below_N", std::to_string(below));
  EXPECT_NEAR(above, 2.0, 0.02);
  EXPECT_NEAR(below, 2.0, 0.02);
  EXPECT_GT(jaws.closed, 1e-4);
}

TEST_P(JawsOn, TurnWhatTheyHoldAndFeelItResist) {
  const double angle = std::numbers::pi / 6.0;
  auto world =
      build(pinched_strip(GetParam(), 2.0, 0.0, {{0.0, 0.0}, {kSettled, 0.0}, {2.0, angle}}));
  ASSERT_TRUE(world);
  const auto across = [&] {  // from the lower jaw's cells to the upper's
    const OrganContact& contact = world->all<OrganContact>()[0];
    const auto& moved = world->all<OrganTouch>()[0].solver->cell_displacements();
    const std::size_t upper = jaws_in(*world).upper;
    Vec3 sum = Vec3::Zero();
    for (std::size_t k = 0; k < 2 * upper; ++k)
      sum += (k < upper ? 1.0 : -1.0) * (contact.cells[k].position + moved[k]);
    return sum;
  };
  step_until(*world, kSettled);
  const Vec3 before = across();
  const double torque_before = jaws_in(*world).torque.x();
  step_until(*world, 2.2);
  const Vec3 after = across(), shaft = jaws_in(*world).shaft;
  const double turned = std::atan2(before.cross(after).dot(shaft), before.dot(after));
  RecordProperty("turned_deg", std::to_string(turned * 180.0 / std::numbers::pi));
  RecordProperty("torque_Nm", std::to_string(jaws_in(*world).torque.x()));
  EXPECT_NEAR(turned, angle, std::numbers::pi / 180.0);
  EXPECT_LT(jaws_in(*world).torque.dot(shaft), torque_before - 1e-4);
  // What is drawn turns, too.
  EXPECT_GT(world->all<OrganState>()[0].greatest_displacement, 2e-3);
}

TEST_P(JawsOn, LoseWhatSlidesOutOfThemAndSaySo) {
  auto world = build(pinched_strip(GetParam(), 0.5, 8e-3));
  ASSERT_TRUE(world);
  EXPECT_TRUE(step_until(*world, kSettled + 3.5).has(kTissueLeftJaws));
  EXPECT_FALSE(world->all<InstrumentContact>()[0].grasp);
  EXPECT_EQ(force_on(*world, 0), Vec3::Zero());
  EXPECT_EQ(jaws_in(*world).lost, 1u);
}

TEST_P(JawsOn, LetGoWhenTheyOpen) {
  SceneDescription scene = pinched_strip(GetParam(), 2.0, 0.0);
  std::vector<InstrumentKey>& path = scene.instruments[0].path;
  path.resize(4);
  path.push_back({1.1, path.back().tip, 0.0, 1.0});
  path.push_back({1.6, Vec3(45e-3, 0, 0), 0.0, 1.0});
  auto world = build(scene);
  ASSERT_TRUE(world);
  step_until(*world, 1.7);
  EXPECT_FALSE(world->all<InstrumentContact>()[0].grasp);
  EXPECT_EQ(force_on(*world, 0), Vec3::Zero());
}

TEST_P(JawsOn, LoseWhatIsOppositeToWhatOneOfThemLoses) {
  auto world = build(pinched_strip(GetParam(), 2.0, 0.0));
  ASSERT_TRUE(world);
  step_until(*world, kSettled);
  const Entity tool = world->model().instruments()[0];
  const auto& held = world->find<InstrumentContact>(tool)->grasp;
  ASSERT_TRUE(held);
  const std::vector<ContactCell> before = held->cells;
  const std::size_t upper = jaws_in(*world).upper;
  ASSERT_EQ(before.size(), 2 * upper);
  ASSERT_GT(upper, 3u);
  // The first of the upper jaw and the last of the lower are gone.
  keep_held(*world, tool, [&](std::size_t cell) { return cell != 0 && cell + 1 != before.size(); });
  ASSERT_TRUE(held);
  EXPECT_EQ(jaws_in(*world).upper, upper - 2);
  ASSERT_EQ(held->cells.size(), 2 * (upper - 2));
  EXPECT_EQ(held->points.size(), held->cells.size());
  for (std::size_t k = 0; k < upper - 2; ++k) {
    EXPECT_EQ(held->cells[k].position, before[k + 1].position);
    EXPECT_EQ(held->cells[upper - 2 + k].position, before[upper + k + 1].position);
  }
  keep_held(*world, tool, [&](std::size_t cell) { return cell >= upper - 2; });
  EXPECT_FALSE(held) << "one jaw has nothing any more";
}

TEST_P(JawsOn, GoOnFromASnapshotWithTheSameBits) {
  const Model model = build_shared(pinched_strip(GetParam(), 1.0, 16e-3));
  auto whole = Simulation::create(model), other = Simulation::create(model);
  ASSERT_TRUE(whole && other);
  const auto step_to = [](Simulation& simulation, std::uint64_t frame) {
    while (simulation.frame() < frame) simulation.step();
  };
  step_to(*whole, 80);
  auto snapshot = whole->snapshot();
  ASSERT_TRUE(snapshot) << snapshot.error().text();
  step_to(*whole, 110);
  EXPECT_GT(whole->world().all<Jaws>()[0].way, 0.0);
  step_to(*other, 21);  // it has lived another life
  ASSERT_TRUE(other->restore(*snapshot));
  step_to(*other, 110);
  EXPECT_EQ(other->hash(), whole->hash()) << other->world().state_difference(whole->world());
}
INSTANTIATE_TEST_SUITE_P(Jaws, JawsOn, testing::Values(Response::kLinear, Response::kFinite));

TEST(Jaws, HoldTissueWithOneSideAsAPatchAndSlipOffItAtTheirLimit) {
  SceneDescription scene = soft_ball_scene(6e-3, 4e-3);
  InstrumentDescription grasper = straight_tool("grasper", InstrumentKind::kGrasper, 2e-3,
                                                {{0.0, Vec3(0, 0, 29e-3), 0.0, 1.0},
                                                 {0.2, Vec3(0, 0, 26e-3), 0.0, 1.0},
                                                 {0.4, Vec3(0, 0, 26e-3), 0.0, 0.0},
                                                 {1.0, Vec3(0, 0, 31e-3), 0.0, 0.0}});
  set_jaws(grasper, {0.05, 1.0, {}});
  scene.instruments = {grasper};
  auto world = build(scene);
  ASSERT_TRUE(world);
  step_until(*world, 0.5);
  EXPECT_TRUE(world->all<InstrumentContact>()[0].grasp);
  EXPECT_EQ(jaws_in(*world).upper, 0u);
  Trace trace(stage_names());
  bool slid = false;
  while (world->time() < 1.0 && world->all<InstrumentContact>()[0].grasp) {
    step_frame(*world, trace);
    if (!jaws_in(*world).sliding || !world->all<InstrumentContact>()[0].grasp) continue;
    slid = true;
    EXPECT_NEAR(friction_on(*world), 0.1, 0.005);
  }
  EXPECT_TRUE(slid);
}

TEST(Jaws, PressLessTheFartherTheHandleIsOpen) {
  EXPECT_EQ(share_of_grip(0.0), 1.0);
  EXPECT_NEAR(share_of_grip(0.15), 0.5, 1e-12);
  EXPECT_EQ(share_of_grip(0.3), 0.0);
  EXPECT_EQ(share_of_grip(1.0), 0.0);
}

}  // namespace
}  // namespace viscera::test
