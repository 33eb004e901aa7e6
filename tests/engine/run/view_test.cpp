#include "engine/run/view.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "engine/features/clips/clips.h"
#include "engine/features/parting/parting.h"
#include "kernels/contact/deformation.h"
#include "tests/support/cutting.h"
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

/// A bar that a scalpel cuts half through, behind a clip.
SceneDescription clipped_and_cut_bar() {
  SceneDescription scene = held_bar_scene(Vec3(40e-3, 8e-3, 7e-3), 1.5e-3, 0.1e-3, 2.4e-3, 2.4e-3);
  scene.organs[0].response = Response::kFinite;
  scene.organs[0].extras.set(CuttableDescription{0.4e-3});
  const Vec3 clip(0, 5.5e-3, 0), tip(8e-3, 12e-3, 0);
  InstrumentDescription applier =
      straight_tool("applier", InstrumentKind::kClipApplier, 1e-3,
                    {{0.0, clip, 0.0, 1.0}, {0.1, clip, 0.0, 0.0}, {0.2, clip, 0.0, 1.0}});
  applier.trocar = clip - Vec3(0, 0.2, 0);
  applier.extras.set(ClipsDescription{.count = 3, .length = 11e-3, .opening = 10e-3});
  scene.instruments = {applier,
                       upright_scalpel(tip, tip - Vec3(0, 24e-3, 0), 0.3, 0.5, {16e-3, 0.8e-3})};
  scene.camera = looking_along_y(0.0);
  return scene;
}

TEST(View, ShowsAllClipsThatAnApplierHasFromTheFirstPictureOn) {
  const SceneDescription scene = clipped_and_cut_bar();
  const auto world = build(scene);
  ASSERT_TRUE(world);
  Shown shown;
  const Endoscope endoscope(*scene.camera);
  const auto clips_of_view = [&] {
    std::vector<InstrumentView> clips;
    for (const InstrumentView& one : make_view(*world, shown, scene, endoscope, 0).instruments)
      if (one.kind == InstrumentView::Kind::kClip) clips.push_back(one);
    return clips;
  };
  step_until(*world, 0.02);
  const auto before = clips_of_view();
  ASSERT_EQ(before.size(), 3u);
  EXPECT_EQ(before[0].jaw, 10e-3) << "it waits in the jaws";
  step_until(*world, 0.5);
  const auto after = clips_of_view();
  ASSERT_EQ(after.size(), 3u);
  EXPECT_EQ(after[0].id, before[0].id);
  EXPECT_LT(after[0].jaw, 5e-3) << "it has squeezed";
  EXPECT_LT(after[0].tip.norm(), 1e-3);
  EXPECT_EQ(after[1].jaw, 10e-3) << "the next one waits";
  EXPECT_NE(after[1].id, after[2].id);
}

TEST(View, ShadesSkinThatEndsAtACutAsSkin) {
  const SceneDescription scene = clipped_and_cut_bar();
  const auto world = build(scene);
  ASSERT_TRUE(world);
  while (world->all<OrganCut>()[0].bodies == 0 && world->time() < 3.0)
    step_until(*world, world->time() + 0.01);
  step_until(*world, world->time() + 0.1);
  Shown shown;
  const FrameView view = make_view(*world, shown, scene, Endoscope(*scene.camera), 0);
  const OrganView& bar = view.organs[0];
  ASSERT_EQ(bar.depths.size(), bar.positions.size());
  std::vector<char> meets_wall(bar.depths.size(), 0);
  for (const std::array<int, 3>& corners : bar.rest->triangles)
    if (std::ranges::any_of(corners, [&](int corner) {
          return bar.depths[static_cast<std::size_t>(corner)] > 0.0f;
        }))
      for (const int corner : corners) meets_wall[static_cast<std::size_t>(corner)] = 1;
  int at_rim = 0;
  for (std::size_t v = 0; v < meets_wall.size(); ++v) {
    const Vec3f place = bar.rest->vertices[v].cast<float>();
    // On the flat top or front, away from the bar's own edges.
    const bool top = std::abs(place.y()) < 2.5e-3f, front = std::abs(place.z()) < 2.2e-3f;
    if (!meets_wall[v] || bar.depths[v] > 0.0f || top == front) continue;
    ++at_rim;
    EXPECT_GT(bar.normals[v].dot(top ? Vec3f::UnitZ() : Vec3f::UnitY()), 0.93f) << place;
  }
  EXPECT_GT(at_rim, 12);
}

}  // namespace
}  // namespace viscera::test
