#include "engine/features/held_tools/held_tools.h"

#include <gtest/gtest.h>

#include <cmath>

#include "engine/features/held_tools/haptic_recording.h"
#include "engine/features/local/local.h"
#include "engine/run/state_hash.h"
#include "engine/simulator/build.h"
#include "tests/support/paths.h"
#include "tests/support/small_world.h"

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
  probe.haptic.emplace();
  probe.haptic->grip = HapticDescription::Grip::kFirm;
  scene.instruments = {probe};
  return scene;
}

// The world with its haptic tools; a test failure where it can't be built.
std::unique_ptr<World> held(const SceneDescription& scene, const ServoRun& run = {}) {
  auto world = build(scene);
  if (!world) return nullptr;
  if (const auto hand = hold_tools(*world, run); !hand) {
    ADD_FAILURE() << hand.error().text();
    return nullptr;
  }
  return world;
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
  SceneDescription scene = held_probe(Response::kGlobal);
  scene.instruments[0].haptic.reset();
  auto world = build(scene);
  ASSERT_TRUE(world);
  const auto haptics = HapticTools::create(scene, *world, {});
  ASSERT_TRUE(haptics);
  EXPECT_EQ(*haptics, nullptr);
}

TEST(HapticTools, WithoutAServoThePathMovesAHeldTool) {
  auto world = build(held_probe(Response::kGlobal));
  ASSERT_TRUE(world);
  step_until(*world, 1.2);
  EXPECT_NEAR(world->all<InstrumentState>()[0].tip.z(), kTop + kTip - 3e-3, 1e-9);
  EXPECT_GT(force_on(*world, 0).z(), 0.0);
}

TEST(HapticTools, TheHandMovesTheToolAndTheTissueHoldsItBack) {
  auto world = held(held_probe(Response::kGlobal));
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

// The hand feels what the global model says at the same tip.
TEST(HapticTools, TheHivesForceIsTheGlobalModelsWithinFivePercent) {
  auto world = held(held_probe(Response::kGlobal));
  ASSERT_TRUE(world);
  step_until(*world, 1.45);
  const double felt = tool_of(*world).output.tissue.z(), frame = force_on(*world, 0).z();
  EXPECT_GT(frame, 0.05);
  EXPECT_NEAR(felt, frame, 0.05 * frame);
}

TEST(HapticTools, WhatAnOrganIsMadeOfIsFeltBeyondLinearAndRepeats) {
  const auto felt = [](HyperelasticModel model, std::vector<PronyTerm> prony,
                       std::string* hash = nullptr) {
    SceneDescription scene = held_probe(Response::kLocal);
    scene.organs[0].material.model = model;
    scene.organs[0].material.prony = std::move(prony);
    auto world = held(scene);
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
  auto world = held(held_probe(Response::kLocal));
  ASSERT_TRUE(world);
  EXPECT_EQ(world->all<OrganContact>().size(), 0u);
  ASSERT_EQ(world->all<LocalOrgan>().size(), 1u);
  step_until(*world, 1.45);
  const OrganState& state = world->all<OrganState>()[0];
  const double depth = kTop + kTip - world->all<InstrumentState>()[0].tip.z();
  EXPECT_GT(depth, 0.5e-3);
  EXPECT_NEAR(state.greatest_displacement, depth, 0.25 * depth);
  EXPECT_GT(tool_of(*world).output.tissue.z(), 0.0);
  // The frame's own hive and the servo's say the same.
  EXPECT_NEAR(force_on(*world, 0).z(), tool_of(*world).output.tissue.z(),
              0.02 * force_on(*world, 0).z());
  step_until(*world, 2.0);
  EXPECT_EQ(world->all<OrganState>()[0].greatest_displacement, 0.0);
}

TEST(HapticTools, LockstepGivesTheSameStateEveryTime) {
  auto first = held(held_probe(Response::kLocal)), second = held(held_probe(Response::kLocal));
  ASSERT_TRUE(first && second);
  EXPECT_EQ(hash_until(*first, 2.0), hash_until(*second, 2.0));
}

TEST(HapticTools, ARecordingReplaysToTheSameForces) {
  const TemporaryFolder folder;
  SceneDescription scene = held_probe(Response::kLocal);
  std::string hash;
  {
    auto world = held(scene, {ServoClock::kLockstep, 0.0, true});
    ASSERT_TRUE(world);
    hash = forces_until(*world, 2.0);
    const auto saved = save_recording(folder / "hand.h5", tool_of(*world).recorder->recording());
    ASSERT_TRUE(saved) << saved.error().text();
  }
  scene.instruments[0].haptic->device = HapticDescription::Device::kRecorded;
  scene.instruments[0].haptic->recording = folder / "hand.h5";
  auto world = held(scene);
  ASSERT_TRUE(world);
  EXPECT_EQ(forces_until(*world, 2.0), hash);
}

TEST(HapticTools, MistakesNameTheInstrument) {
  SceneDescription scene = held_probe(Response::kGlobal);
  scene.instruments[0].path[1].tip.x() += 2.0;
  auto world = build(scene);
  ASSERT_TRUE(world);
  const auto far = HapticTools::create(scene, *world, {});
  ASSERT_FALSE(far);
  EXPECT_NE(far.error().text().find("instruments/0/haptic: path/"), std::string::npos)
      << far.error().text();
  EXPECT_NE(far.error().text().find("work space"), std::string::npos);

  scene = held_probe(Response::kGlobal);
  scene.instruments[0].haptic->device = HapticDescription::Device::kRecorded;
  scene.instruments[0].haptic->recording = "/nowhere/hand.csv";
  const auto missing = HapticTools::create(scene, *world, {});
  ASSERT_FALSE(missing);
  EXPECT_NE(missing.error().text().find("hand.csv"), std::string::npos);

  scene = held_probe(Response::kGlobal);
  scene.instruments[0].tip.shape = TipDescription::Shape::kCapsule;
  const auto capsule = HapticTools::create(scene, *world, {});
  ASSERT_FALSE(capsule);
  EXPECT_NE(capsule.error().text().find("expected sphere or point"), std::string::npos);
}

}  // namespace
}  // namespace viscera::test
