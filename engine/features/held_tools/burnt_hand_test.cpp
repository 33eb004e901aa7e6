// A hand on tissue that a hook has coagulated, beside the frame's own contact with the same tissue.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <optional>

#include "engine/features/coagulation/coagulation.h"
#include "engine/features/held_tools/held_tools.h"
#include "engine/simulator/build.h"
#include "tests/support/small_world.h"

namespace viscera::test {
namespace {

constexpr double kPole = 25e-3;

/// A hook burns the pole of a ball for a second and leaves; a hand's ball tip then presses at
/// `aside` from there.
SceneDescription burnt_then_held(double power, Response response, double aside) {
  auto scene = soft_ball_scene(6e-3, 4e-3);
  scene.organs[0].response = response;
  scene.organs[0].resolution.fine = {ball_region(Vec3(0, 0, kPole), 10e-3)};
  scene.duration = 4.0;
  const double angle = aside / kPole;
  const Vec3 out(std::sin(angle), 0, std::cos(angle));
  scene.instruments = {straight_tool("probe", InstrumentKind::kProbe, 2e-3,
                                     {{0.0, (kPole + 40e-3) * out, 0.0, 1.0},
                                      {1.6, (kPole + 10e-3) * out, 0.0, 1.0},
                                      {2.0, (kPole + 0.8e-3) * out, 0.0, 1.0},
                                      {9.0, (kPole + 0.8e-3) * out, 0.0, 1.0}}),
                       straight_tool("hook", InstrumentKind::kHook, 1e-3,
                                     {{0.0, Vec3(0, 0, kPole + 3e-3), 0.0, 1.0},
                                      {0.2, Vec3(0, 0, kPole + 0.2e-3), power, 1.0},
                                      {1.2, Vec3(0, 0, kPole), 0.0, 1.0},
                                      {1.4, Vec3(0, 0, kPole + 30e-3), 0.0, 1.0}})};
  scene.instruments[0].extras.get<HapticDescription>().grip = HapticDescription::Grip::kFirm;
  return scene;
}

struct HeldPress {
  Vec3 felt;
  double agreement = 0.0, greatest_step = 0.0, stiffness = 1.0;
  std::uint64_t violations = 0;
};

std::optional<HeldPress> hold_and_press(const SceneDescription& scene) {
  auto world = build(scene);
  if (!world || !hold_tools(*world, {})) return std::nullopt;
  HapticTool& tool = servos_of(*world)->tools().front();
  HeldPress told;
  Trace trace(stage_names());
  Vec3 before = Vec3::Zero();
  while (world->time() < 2.5) {
    step_frame(*world, trace);
    const Vec3 felt = tool.servo->output().tissue;
    if (world->time() < 2.2)
      tool.agreement = {.tip = tool.agreement.tip};
    else
      told.greatest_step = std::max(told.greatest_step, (felt - before).norm());
    before = felt;
  }
  told.felt = before;
  told.agreement = tool.agreement.ratio();
  told.violations = tool.servo->passivity_violations();
  if (world->all<OrganUpdate>().size() > 0 && world->all<OrganUpdate>()[0].update)
    told.stiffness = world->all<OrganUpdate>()[0].update->greatest_stiffness;
  return told;
}

TEST(BurntHand, FeelsWhatTheFrameHasOfCoagulatedTissue) {
  for (const auto& [response, within] :
       {std::pair(Response::kLinear, 0.08), std::pair(Response::kFinite, 0.05)})
    for (const double aside : {0.0, 2e-3, 4e-3}) {
      const auto sound = hold_and_press(burnt_then_held(0.0, response, aside));
      const auto burnt = hold_and_press(burnt_then_held(30.0, response, aside));
      ASSERT_TRUE(sound && burnt);
      std::printf(
          "%s, %.0f mm aside: modulus x%.1f, felt %.4f N, from the frame %.1f %%, steps "
          "%.5f N; sound tissue %.4f N, %.1f %%\n",
          response == Response::kFinite ? "finite" : "linear", 1e3 * aside, burnt->stiffness,
          burnt->felt.norm(), 100.0 * burnt->agreement, burnt->greatest_step, sound->felt.norm(),
          100.0 * sound->agreement);
      EXPECT_GT(burnt->stiffness, 3.0);
      EXPECT_GT(burnt->felt.norm(), 0.01);
      EXPECT_GT(burnt->agreement, 0.0);
      EXPECT_LT(burnt->agreement, within);
      EXPECT_LT(sound->agreement, 0.01);
      EXPECT_LT(burnt->greatest_step, 5e-3);
      EXPECT_EQ(burnt->violations, 0u);
    }
}

}  // namespace
}  // namespace viscera::test
