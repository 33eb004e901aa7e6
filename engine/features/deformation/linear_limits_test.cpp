// Organs that are moved beyond what linear tissue carries say so.
#include "engine/features/deformation/linear_limits.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "engine/features/deformation/deformation.h"
#include "tests/support/small_world.h"

namespace viscera::test {
namespace {

constexpr double kTop = 25e-3;                  // pole of the ball [m]
const Vec3 kBar(90e-3, 16e-3, 16e-3);           // edges [m]
constexpr double kHeld = 12e-3;                 // of its left end [m]
constexpr double kClosed = 0.4, kLifted = 0.8;  // [s]

/// A jaw takes the bar near its free end and lifts it.
SceneDescription lifted_bar(double lift) {
  SceneDescription scene = held_bar_scene(kBar, 2e-3, kHeld, 5e-3, 4e-3);
  const Vec3 above(0.5 * kBar.x() - 8e-3, 0, 0.5 * kBar.z() + 1e-3);
  InstrumentDescription grasper =
      straight_tool("grasper", InstrumentKind::kGrasper, 4e-3,
                    {{0.0, above + Vec3(0, 0, 5e-3), 0.0, 1.0},
                     {0.2, above + Vec3(0, 0, 3e-3), 0.0, 1.0},
                     {kClosed, above + Vec3(0, 0, 3e-3), 0.0, 0.0},
                     {kLifted, above + Vec3(0, 0, 3e-3 + lift), 0.0, 0.0}});
  grasper.grip_radius = 5e-3;
  grasper.grip_limit = 100.0;
  scene.instruments = {grasper};
  return scene;
}

SceneDescription pressed_ball(double radius, double depth) {
  auto scene = soft_ball_scene(6e-3, 3e-3);
  scene.instruments = {straight_tool("probe", InstrumentKind::kProbe, radius,
                                     {{0.0, Vec3(0, 0, kTop + radius + 1e-3), 0.0, 1.0},
                                      {0.5, Vec3(0, 0, kTop + radius - depth), 0.0, 1.0}})};
  return scene;
}

TEST(LinearLimits, ABarThatIsLiftedFarIsBeyondThemAndTheReportSaysWhereAndWhen) {
  const double lift = 16e-3;
  auto world = build(lifted_bar(lift));
  ASSERT_TRUE(world);
  EXPECT_FALSE(step_until(*world, kClosed).has(kBeyondLinear));
  EXPECT_TRUE(step_until(*world, 1.0).has(kBeyondLinear));
  const GreatestStrains& greatest = world->all<GreatestStrains>()[0];
  // A cantilever turns at its end by 3/2 of what it is lifted over its length, and by its jaw
  // somewhat more; it is thick, so shear takes part of the lift.
  const double turned = 1.5 * lift / (kBar.x() - kHeld - 8e-3);
  EXPECT_NEAR(greatest.rotation.value / turned, 1.0, 0.25);
  EXPECT_NEAR(greatest.rotation.time, kLifted, 0.05);
  const std::vector<std::string> warnings = deformation_warnings(*world);
  ASSERT_EQ(warnings.size(), 1u);
  EXPECT_TRUE(warnings[0].starts_with("bar: turned by up to 0.")) << warnings[0];
}

TEST(LinearLimits, ABarThatIsLiftedALittleIsWithinThem) {
  auto world = build(lifted_bar(4e-3));
  ASSERT_TRUE(world);
  EXPECT_FALSE(step_until(*world, 1.0).has(kBeyondLinear));
  EXPECT_TRUE(world->all<OrganState>()[0].deformed);
  EXPECT_TRUE(deformation_warnings(*world).empty());
}

TEST(LinearLimits, AGentlyPressedOrganIsWithinThemAndADeeplyPressedOneIsNot) {
  auto gentle = build(pressed_ball(5e-3, 0.5e-3));
  auto deep = build(pressed_ball(5e-3, 5e-3));
  ASSERT_TRUE(gentle && deep);
  EXPECT_FALSE(step_until(*gentle, 0.7).has(kBeyondLinear));
  EXPECT_GT(force_on(*gentle, 0).z(), 0.0);
  EXPECT_TRUE(step_until(*deep, 0.7).has(kBeyondLinear));
  // On the dent's wall, which the warning says.
  const GreatestStrain& rotation = deep->all<GreatestStrains>()[0].rotation;
  EXPECT_TRUE(rotation.under_tool);
  EXPECT_LT((rotation.place - Vec3(0, 0, kTop)).norm(), 8e-3) << rotation.place.transpose();
  EXPECT_NE(deformation_warnings(*deep).at(0).find("under a tool"), std::string::npos);
}

TEST(LinearLimits, MeasureWhatTheShapeIsTurnedAndStretchedBy) {
  auto world = build(pressed_ball(5e-3, 0.5e-3));
  ASSERT_TRUE(world);
  const OrganModel& model = *world->all<OrganBody>()[0].model;
  OrganState& state = world->all<OrganState>()[0];
  const auto shape = [&](const Mat3& map) {
    for (std::size_t v = 0; v < state.positions.size(); ++v) {
      state.positions[v] = Vec3(map * model.surface.vertices[v]).cast<float>();
      state.greatest_displacement =
          std::max(state.greatest_displacement,
                   double{(state.positions[v] - model.rest_positions[v]).norm()});
    }
    state.deformed = true;
    ++state.version;
    return measure_strains(*world, 0.25);
  };
  const Mat3 turn = Eigen::AngleAxisd(0.18, Vec3(1, 1, 1).normalized()).toRotationMatrix();
  const GreatestStrains& greatest = world->all<GreatestStrains>()[0];
  EXPECT_FALSE(shape(turn));
  EXPECT_NEAR(greatest.rotation.value, 0.18, 1e-3);
  EXPECT_LT(greatest.stretch.value, 1e-4);
  EXPECT_TRUE(shape(Eigen::AngleAxisd(0.22, Vec3(1, 1, 1).normalized()).toRotationMatrix()));
  EXPECT_NEAR(greatest.rotation.value, 0.22, 1e-3);
  EXPECT_EQ(greatest.rotation.time, 0.25);
  EXPECT_FALSE(shape(Vec3(1.14, 0.95, 0.95).asDiagonal()));
  EXPECT_TRUE(shape(Vec3(1.17, 0.95, 0.95).asDiagonal()));
  EXPECT_NEAR(greatest.stretch.value, 0.17, 3e-3);
  EXPECT_NEAR(greatest.rotation.value, 0.22, 1e-3) << "the greatest since the start";
}

TEST(LinearLimits, AreMeasuredOnceForEachShape) {
  auto world = build(pressed_ball(5e-3, 3e-3));
  ASSERT_TRUE(world);
  step_until(*world, 0.7);
  const StrainsNow before = world->all<StrainsNow>()[0];
  ASSERT_TRUE(before.known);
  EXPECT_EQ(before.version, world->all<OrganState>()[0].version);
  forget_strains(*world);
  EXPECT_FALSE(world->all<StrainsNow>()[0].known);
  measure_strains(*world, 1.0);
  EXPECT_EQ(world->all<StrainsNow>()[0].strains.rotation, before.strains.rotation);
}

}  // namespace
}  // namespace viscera::test
