// Organs at finite strain with too many nodes for a factor.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "engine/organ/organ_plan.h"
#include "engine/simulator/build.h"
#include "kernels/base/sanitized.h"
#include "kernels/finite/finite_solver.h"
#include "tests/support/paths.h"
#include "tests/support/resident_memory.h"
#include "tests/support/small_world.h"

namespace viscera::test {
namespace {

constexpr double kEdge = 40e-3, kTip = 5e-3;  // [m]

/// A cube that a ball presses from above.
SceneDescription pressed_cube(double spacing) {
  SceneDescription scene =
      held_bar_scene(Vec3::Constant(kEdge), 2.5e-3, 0.2 * kEdge, spacing, spacing);
  scene.organs[0].response = Response::kFinite;
  scene.duration = 1.0;
  const Vec3 above(0, 0, 0.5 * kEdge + kTip);
  scene.instruments = {straight_tool(
      "probe", InstrumentKind::kProbe, kTip,
      {{0.0, above + Vec3(0, 0, 1e-3), 0.0, 1.0}, {0.2, above - Vec3(0, 0, 2e-3), 0.0, 1.0}})};
  return scene;
}

TEST(LargeFinite, IsPreparedWithinWhatTheGuardSaysAndTakesHalfOfThatAtLeast) {
  if (kSanitized) GTEST_SKIP() << "a sanitizer keeps memory that was given back";
  const SceneDescription scene = pressed_cube(2.05e-3);
  Reach reach;
  reach.radius = 10e-3;
  reach.tips.push_back({.at = Vec3(0, 0, 0.5 * kEdge)});
  const auto plan = plan_organ(scene.organs[0], test_tissues().at("rubber"), reach,
                               {project_file("assets"), false});
  ASSERT_TRUE(plan) << plan.error().text();
  if (!forget_greatest()) GTEST_SKIP() << "the kernel doesn't count anew";
  const double before = resident("VmRSS");
  const auto world = build(scene);
  ASSERT_TRUE(world);
  const double taken = resident("VmHWM") - before;
  const OrganModel& model = *world->all<OrganBody>()[0].model;
  std::printf("%zu nodes: %.0f MB of %.0f MB said, kept %.0f MB of %.0f MB said\n", plan->nodes,
              1e-6 * taken, 1e-6 * static_cast<double>(plan->preparation_bytes),
              1e-6 * static_cast<double>(model.memory_bytes()),
              1e-6 * static_cast<double>(plan->memory_bytes));
  ASSERT_TRUE(model.finite->levels());
  EXPECT_EQ(model.column_figures().prepared, 0u) << "columns are made when they are asked for";
  EXPECT_LE(taken, static_cast<double>(plan->preparation_bytes));
  EXPECT_GE(2.0 * taken, static_cast<double>(plan->preparation_bytes));
  EXPECT_LE(model.memory_bytes(), plan->memory_bytes);
  EXPECT_GE(2 * model.memory_bytes(), plan->memory_bytes);
}

}  // namespace
}  // namespace viscera::test
