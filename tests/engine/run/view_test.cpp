#include "engine/run/view.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "kernels/contact/deformation.h"
#include "tests/support/small_world.h"

namespace viscera::test {
namespace {

CameraDescription looking_along_y(double optics) {
  CameraDescription camera;
  camera.optics = optics;
  CameraKey key;
  key.tip = Vec3(0, -0.1, 0);
  key.target = Vec3(0, 0, 0);
  camera.path = {key};
  return camera;
}

TEST(Endoscope, StraightOpticsLookAlongTheShaft) {
  const CameraView view = Endoscope(looking_along_y(0.0)).at(0.0);
  EXPECT_LT((view.forward - Vec3::UnitY()).norm(), 1e-12);
  EXPECT_LT((view.up - Vec3::UnitZ()).norm(), 1e-12);
}

TEST(Endoscope, ThirtyDegreeOpticsLookThirtyDegreesDown) {
  const double angle = std::numbers::pi / 6.0;
  const CameraView view = Endoscope(looking_along_y(angle)).at(0.0);
  EXPECT_NEAR(view.forward.dot(Vec3::UnitY()), std::cos(angle), 1e-12);
  EXPECT_NEAR(view.forward.z(), -0.5, 1e-12);
  EXPECT_NEAR(view.up.dot(view.forward), 0.0, 1e-12);
}

TEST(Endoscope, RollTurnsTheOpticsAboutTheShaft) {
  CameraDescription camera = looking_along_y(std::numbers::pi / 6.0);
  camera.path[0].roll = std::numbers::pi / 2.0;
  const CameraView view = Endoscope(camera).at(0.0);
  EXPECT_NEAR(view.forward.z(), 0.0, 1e-12);
  // Right-handed about the way the shaft points, +y: what looked down looks to -x.
  EXPECT_NEAR(view.forward.x(), -0.5, 1e-12);
  EXPECT_NEAR(view.up.x(), std::cos(std::numbers::pi / 6.0), 1e-12);
}

TEST(View, LightOfTheReferenceTemperatureIsWhiteAndCoolerLightIsRed) {
  EXPECT_LT((light_colour(5600.0) - Vec3::Ones()).norm(), 1e-12);
  const Vec3 warm = light_colour(3200.0);
  EXPECT_EQ(warm.x(), 1.0);
  EXPECT_LT(warm.z(), warm.y());
}

TEST(View, ShowsWhatTheWorldHolds) {
  auto scene = soft_ball_scene(7e-3, 5e-3);
  scene.camera = looking_along_y(0.0);
  scene.instruments = {straight_tool("grasper", InstrumentKind::kGrasper, 2e-3,
                                     {{0.0, Vec3(0, 0, 40e-3), 0.0, 0.4}})};
  auto world = build(scene);
  ASSERT_TRUE(world);
  step_until(*world, 0.1);
  Shown shown;
  const FrameView view = make_view(*world, shown, scene, Endoscope(*scene.camera), 3);
  ASSERT_EQ(view.organs.size(), 1u);
  EXPECT_EQ(view.organs[0].positions.size(), view.organs[0].rest->vertices.size());
  ASSERT_EQ(view.instruments.size(), 1u);
  EXPECT_EQ(view.instruments[0].kind, InstrumentView::Kind::kGrasper);
  EXPECT_NEAR(view.instruments[0].jaw, 0.4, 1e-12);
  EXPECT_NEAR(view.instruments[0].shaft_direction.z(), 1.0, 1e-12);
  EXPECT_NEAR(view.instruments[0].side_direction.dot(view.instruments[0].shaft_direction), 0.0,
              1e-12);
  EXPECT_EQ(view.frame, 3u);
}

TEST(View, NormalsAreThoseOfThePressedShapeAndTheWorldStaysAsItWas) {
  auto scene = soft_ball_scene(7e-3, 5e-3);
  scene.camera = looking_along_y(0.0);
  scene.instruments = {
      straight_tool("probe", InstrumentKind::kProbe, 4e-3,
                    {{0.0, Vec3(0, 0, 30e-3), 0.0, 1.0}, {0.3, Vec3(0, 0, 26e-3), 0.0, 1.0}})};
  auto world = build(scene);
  ASSERT_TRUE(world);
  Shown shown;
  const Endoscope endoscope(*scene.camera);
  for (const double time : {0.2, 0.3}) {
    step_until(*world, time);
    const OrganState& state = world->all<OrganState>()[0];
    ASSERT_TRUE(state.pressed);
    ASSERT_FALSE(state.normals_fit);
    const std::vector<Vec3f> before = state.normals;
    const FrameView view = make_view(*world, shown, scene, endoscope, 0);
    EXPECT_FALSE(state.normals_fit);
    EXPECT_EQ(state.normals, before);
    std::vector<Vec3f> expected;
    deformed_normals(world->all<OrganBody>()[0].model->drawn, state.positions, expected);
    EXPECT_TRUE(std::ranges::equal(view.organs[0].normals, expected)) << time;
    EXPECT_EQ(make_view(*world, shown, scene, endoscope, 1).organs[0].normals.data(),
              view.organs[0].normals.data())
        << "they are made once a shape";
  }
}

}  // namespace
}  // namespace viscera::test
