#include "engine/features/held_tools/held_tools.h"

#include <gtest/gtest.h>

#include <cmath>
#include <optional>

#include "engine/features/held_tools/haptic_recording.h"
#include "engine/features/local/local.h"
#include "engine/run/state_hash.h"
#include "engine/simulator/build.h"
#include "tests/support/held_world.h"
#include "tests/support/paths.h"

namespace viscera::test {
namespace {

constexpr double kTop = 25e-3;  // pole of the ball [m]
constexpr double kTip = 4e-3;

InstrumentKey key(double time, Vec3 tip) {
  return {time, tip, 0.0, 1.0};
}

// A hand that presses the ball's pole 3 mm deep, and lets go again.
SceneDescription held_probe(Response response) {
  SceneDescription scene = soft_ball_scene(6e-3, 3e-3);
  scene.organs[0].response = response;
  InstrumentDescription probe = straight_tool(
      "probe", InstrumentKind::kProbe, kTip,
      {key(0.0, Vec3(0, 0, kTop + kTip + 5e-3)), key(0.6, Vec3(1e-3, 0, kTop + kTip + 5e-3)),
       key(1.0, Vec3(1e-3, 0, kTop + kTip - 3e-3)), key(1.5, Vec3(1e-3, 0, kTop + kTip - 3e-3)),
       key(1.9, Vec3(1e-3, 0, kTop + kTip + 5e-3))});
  probe.extras.get<HapticDescription>().grip = HapticDescription::Grip::kFirm;
  scene.instruments = {probe};
  return scene;
}

const HapticTool& tool_of(const World& world) {
  return servos_of(world)->tools().front();
}

std::string hash_until(World& world, double time) {
  StateHash hash;
  Trace trace(stage_names());
  while (world.time() < time - 1e-9) {
    step_frame(world, trace);
    hash.add_frame(world);
  }
  return hash.finish(world);
}

/// Of where tools are, what they feel and how organs yield: all but the device itself, as a
/// recording is another one than the recorded.
std::string forces_until(World& world, double time) {
  Hasher hasher;
  Trace trace(stage_names());
  while (world.time() < time - 1e-9) {
    step_frame(world, trace);
    const Vec3 felt = tool_of(world).output.force, tip = world.all<InstrumentState>()[0].tip;
    hasher.bytes(felt.data(), sizeof(Vec3)).bytes(tip.data(), sizeof(Vec3));
    for (const OrganState& organ : world.all<OrganState>())
      hasher.bytes(organ.positions.data(), organ.positions.size() * sizeof(Vec3f));
  }
  return hasher.hex();
}

TEST(HapticTools, ASceneWithoutOneHasNone) {
  SceneDescription scene = held_probe(Response::kLinear);
  scene.instruments[0].extras.remove<HapticDescription>();
  auto world = build(scene);
  ASSERT_TRUE(world);
  const auto haptics = HapticTools::create(scene, *world, {});
  ASSERT_TRUE(haptics);
  EXPECT_EQ(*haptics, nullptr);
}

TEST(HapticTools, WithoutAServoThePathMovesAHeldTool) {
  auto world = build(held_probe(Response::kLinear));
  ASSERT_TRUE(world);
  step_until(*world, 1.2);
  EXPECT_NEAR(world->all<InstrumentState>()[0].tip.z(), kTop + kTip - 3e-3, 1e-9);
  EXPECT_GT(force_on(*world, 0).z(), 0.0);
}

TEST(HapticTools, TheHandMovesTheToolAndTheTissueHoldsItBack) {
  auto world = in_hand(held_probe(Response::kLinear));
  ASSERT_TRUE(world);
  step_until(*world, 0.5);
  EXPECT_EQ(tool_of(*world).output.force, Vec3::Zero());
  step_until(*world, 1.4);
  const double wanted = kTop + kTip - 3e-3;
  EXPECT_GT(world->all<InstrumentState>()[0].tip.z(), wanted);
  EXPECT_LT(world->all<InstrumentState>()[0].tip.z(), kTop + kTip);
  EXPECT_GT(tool_of(*world).output.force.z(), 0.0);
  EXPECT_EQ(tool_of(*world).servo->passivity_violations(), 0u);
  step_until(*world, 2.0);
  EXPECT_EQ(tool_of(*world).output.force, Vec3::Zero());
}

// Hand and picture meet one tissue: what a frame finds at the same tip is what the hand felt.
TEST(HapticTools, AtRestTheFramesForceIsTheHandsWithinThreePercent) {
  for (const Response response : {Response::kLinear, Response::kLocal, Response::kFinite}) {
    auto world = in_hand(held_probe(response));
    ASSERT_TRUE(world);
    step_until(*world, 1.49);
    EXPECT_GT(tool_of(*world).output.tissue.z(), 0.05);
    EXPECT_GT(tool_of(*world).agreement.frames, 10u);
    EXPECT_GT(tool_of(*world).agreement.ratio(), 0.0);
    EXPECT_LT(tool_of(*world).agreement.ratio(), 0.03);
    // Curves and tables hold what was felt.
    EXPECT_EQ(force_on(*world, 0), tool_of(*world).output.tissue);
  }
}

/// A jaw that closes at 40 degrees from the pole of the ball and then moves by `lift` within half a
/// second.
InstrumentDescription jaw_beside(const Vec3& lift) {
  const Vec3 out = Vec3(std::sin(0.7), 0.0, std::cos(0.7));
  const Vec3 at = (kTop + 2.2e-3) * out;
  auto jaw = straight_tool("jaw", InstrumentKind::kGrasper, 2e-3,
                           {{0.0, at, 0.0, 1.0},
                            {0.1, at, 0.0, 0.0},
                            {0.2, at, 0.0, 0.0},
                            {0.7, at + lift, 0.0, 0.0},
                            {3.0, at + lift, 0.0, 0.0}});
  jaw.grip_limit = 100.0;
  return jaw;
}

/// What the hand feels after 1.45 s, with another tool in the scene, or none.
struct Felt {
  double force = 0.0, depth = 0.0;  ///< [N]; how far the tool is below where the pole was [m]
};
Felt felt_beside(Response response, const std::optional<InstrumentDescription>& other) {
  SceneDescription scene = held_probe(response);
  if (other) scene.instruments.push_back(*other);
  auto world = in_hand(scene);
  if (!world) return {};
  step_until(*world, 1.45);
  return {tool_of(*world).output.tissue.z(),
          kTop + kTip - tool_of(*world).output.tool.position.z()};
}

TEST(HapticTools, AJawThatLiftsTheOrganLiftsItIntoTheHand) {
  for (const Response response : {Response::kLinear, Response::kLocal, Response::kFinite}) {
    SCOPED_TRACE(static_cast<int>(response));
    const Felt alone = felt_beside(response, {});
    const Felt lifted = felt_beside(response, jaw_beside(Vec3(0, 0, 3e-3)));
    EXPECT_GT(lifted.force, 1.1 * alone.force);
    EXPECT_LT(lifted.depth, alone.depth);
  }
}

TEST(HapticTools, TissueThatAJawHoldsBesideIsStiffer) {
  for (const Response response : {Response::kLinear, Response::kLocal, Response::kFinite}) {
    SCOPED_TRACE(static_cast<int>(response));
    const Felt alone = felt_beside(response, {});
    const Felt held = felt_beside(response, jaw_beside(Vec3::Zero()));
    EXPECT_GT(held.force / held.depth, 1.01 * alone.force / alone.depth);
    EXPECT_LT(held.force / held.depth, 1.5 * alone.force / alone.depth);
  }
}

TEST(HapticTools, TwoHandsFeelEachOther) {
  SceneDescription scene = held_probe(Response::kLinear);
  InstrumentDescription second = scene.instruments[0];
  second.name = "second";
  const Vec3 out = Vec3(std::sin(0.55), 0.0, std::cos(0.55));
  for (InstrumentKey& key : second.path) {
    const double height = key.tip.z() - kTop - kTip;
    key.tip = (kTop + kTip + height) * out;
  }
  const Felt alone = felt_beside(Response::kLinear, {});
  const Felt beside = felt_beside(Response::kLinear, second);
  // The other presses the tissue away from under this one.
  EXPECT_LT(beside.force / beside.depth, 0.97 * alone.force / alone.depth);
}

TEST(HapticTools, WhatAnOrganIsMadeOfIsFeltBeyondLinearAndRepeats) {
  const auto felt = [](HyperelasticModel model, std::vector<PronyTerm> prony,
                       std::string* hash = nullptr) {
    SceneDescription scene = held_probe(Response::kLocal);
    scene.organs[0].material.model = model;
    scene.organs[0].material.prony = std::move(prony);
    auto world = in_hand(scene);
    EXPECT_TRUE(world);
    const std::string state = hash_until(*world, 1.45);
    if (hash) *hash = state;
    const HiveTissueFigures figures = tool_of(*world).tissue->figures();
    EXPECT_EQ(figures.newton_steps > 0, model != HyperelasticModel::kLinear);
    EXPECT_EQ(figures.linear_answers, 0u);
    EXPECT_EQ(figures.deadline_misses, 0u);
    EXPECT_EQ(tool_of(*world).servo->passivity_violations(), 0u);
    // The tool gives way where the tissue is stiffer: force over what it is pressed.
    return tool_of(*world).output.tissue.z() /
           (kTop + kTip - tool_of(*world).output.tool.position.z());
  };
  const double linear = felt(HyperelasticModel::kLinear, {});
  std::string first, second;
  const double neo = felt(HyperelasticModel::kNeoHookean, {}, &first);
  EXPECT_NE(neo, linear);
  EXPECT_NEAR(neo, linear, 0.15 * linear);
  EXPECT_EQ(felt(HyperelasticModel::kNeoHookean, {}, &second), neo);
  EXPECT_EQ(first, second);
  // Half a second after it was pressed tissue that relaxes in ten is still stiffer.
  EXPECT_GT(felt(HyperelasticModel::kLinear, {{0.4, 10.0}}), 1.3 * linear);
}

TEST(HapticTools, AnOrganWithoutAGlobalModelIsFeltAndDentedByHivesAlone) {
  auto world = in_hand(held_probe(Response::kLocal));
  ASSERT_TRUE(world);
  ASSERT_EQ(world->all<LocalBody>().size(), 1u);
  EXPECT_FALSE(world->all<OrganBody>()[0].model->touchable_anywhere());
  step_until(*world, 1.45);
  const OrganState& state = world->all<OrganState>()[0];
  const double depth = kTop + kTip - world->all<InstrumentState>()[0].tip.z();
  EXPECT_GT(depth, 0.5e-3);
  EXPECT_NEAR(state.greatest_displacement, depth, 0.25 * depth);
  EXPECT_GT(tool_of(*world).output.tissue.z(), 0.0);
  step_until(*world, 2.0);
  EXPECT_EQ(world->all<OrganState>()[0].greatest_displacement, 0.0);
}

TEST(HapticTools, LockstepGivesTheSameStateEveryTime) {
  auto first = in_hand(held_probe(Response::kLocal)),
       second = in_hand(held_probe(Response::kLocal));
  ASSERT_TRUE(first && second);
  EXPECT_EQ(hash_until(*first, 2.0), hash_until(*second, 2.0));
}

TEST(HapticTools, TheFrameReadsNothingThatServosWriteInRealTime) {
  auto world = in_hand(held_probe(Response::kLocal), {ServoClock::kRealTime, 0.0, true});
  ASSERT_TRUE(world);
  Trace trace(stage_names());
  for (int frame = 0; frame < 10; ++frame) step_frame(*world, trace);
  EXPECT_TRUE(servos_of(*world)->state().tools.empty());
  EXPECT_FALSE(world->state_hash().empty());
  servos_of(*world)->stop();
}

TEST(HapticTools, TheSentinelLeavesServosToTheirOwnGates) {
  auto world = in_hand(held_probe(Response::kLocal));
  ASSERT_TRUE(world);
  Trace trace(stage_names());
  step_frame(*world, trace);
  servos_of(*world)->tools().front().agreement.felt = std::nan("");
  const FrameReport report = step_frame(*world, trace);
  EXPECT_TRUE(report.strays.empty()) << report.strays.front();
}

TEST(HapticTools, ARecordingReplaysToTheSameForces) {
  const TemporaryFolder folder;
  SceneDescription scene = held_probe(Response::kLocal);
  std::string hash;
  {
    auto world = in_hand(scene, {ServoClock::kLockstep, 0.0, true});
    ASSERT_TRUE(world);
    hash = forces_until(*world, 2.0);
    const auto saved = save_recording(folder / "hand.h5", tool_of(*world).recorder->recording());
    ASSERT_TRUE(saved) << saved.error().text();
  }
  scene.instruments[0].extras.get<HapticDescription>().device =
      HapticDescription::Device::kRecorded;
  scene.instruments[0].extras.get<HapticDescription>().recording = folder / "hand.h5";
  auto world = in_hand(scene);
  ASSERT_TRUE(world);
  EXPECT_EQ(forces_until(*world, 2.0), hash);
}

TEST(HapticTools, MistakesNameTheInstrument) {
  SceneDescription scene = held_probe(Response::kLinear);
  scene.instruments[0].path[1].tip.x() += 2.0;
  auto world = build(scene);
  ASSERT_TRUE(world);
  const auto far = HapticTools::create(scene, *world, {});
  ASSERT_FALSE(far);
  EXPECT_NE(far.error().text().find("instruments/0/haptic: path/"), std::string::npos)
      << far.error().text();
  EXPECT_NE(far.error().text().find("work space"), std::string::npos);

  scene = held_probe(Response::kLinear);
  scene.instruments[0].extras.get<HapticDescription>().device =
      HapticDescription::Device::kRecorded;
  scene.instruments[0].extras.get<HapticDescription>().recording = "/nowhere/hand.csv";
  const auto missing = HapticTools::create(scene, *world, {});
  ASSERT_FALSE(missing);
  EXPECT_NE(missing.error().text().find("hand.csv"), std::string::npos);

  scene = held_probe(Response::kLinear);
  scene.instruments[0].tip.shape = TipDescription::Shape::kCapsule;
  const auto capsule = HapticTools::create(scene, *world, {});
  ASSERT_FALSE(capsule);
  EXPECT_NE(capsule.error().text().find("expected sphere or point"), std::string::npos);
}

// What a jaw holds pulls at its tool through the frame, whatever the hand's own tissue says.
TEST(HapticTools, AHeldGraspersPullStaysInWhatIsRecorded) {
  SceneDescription scene = held_probe(Response::kLinear);
  const Vec3 top(0, 0, kTop + 2.2e-3), high = top + Vec3(0, 0, 4e-3);
  scene.instruments[0] = straight_tool("grasper", InstrumentKind::kGrasper, 2e-3,
                                       {{0.0, top, 0.0, 1.0},
                                        {0.2, top, 0.0, 1.0},
                                        {0.3, top, 0.0, 0.0},
                                        {0.8, high, 0.0, 0.0},
                                        {3.0, high, 0.0, 0.0}});
  scene.instruments[0].grip_limit = 100.0;
  scene.instruments[0].extras.get<HapticDescription>().grip = HapticDescription::Grip::kFirm;
  auto world = in_hand(scene);
  ASSERT_TRUE(world);
  step_until(*world, 1.5);
  ASSERT_TRUE(world->all<InstrumentContact>()[0].grasp);
  const Vec3 pull = force_on(*world, 0) - tool_of(*world).output.tissue;
  EXPECT_LT(pull.z(), -0.05);
  EXPECT_EQ(world->all<OrganTouch>()[0].ranges.front().felt,
            world->all<OrganTouch>()[0].ranges.front().force);
}

}  // namespace
}  // namespace viscera::test
