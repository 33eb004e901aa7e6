#include "tools/bench/scene_accuracy.h"

#include <gtest/gtest.h>

#include "engine/scene/soft_ball.h"
#include "tests/support/paths.h"

namespace viscera {
namespace {

/// The soft ball under a ball tip that is pressed in by `depth` [m].
SceneDescription pressed_ball(double depth) {
  SceneDescription scene = soft_ball_scene(14e-3, 7e-3);
  scene.duration = 0.5;
  InstrumentDescription probe;
  probe.name = "probe";
  probe.tip.radius = 3e-3;
  probe.trocar = Vec3(0.0, 0.0, 0.2);
  probe.path = {{0.0, Vec3(0.0, 0.0, 25e-3 + 4e-3), 0.0, 1.0},
                {0.3, Vec3(0.0, 0.0, 25e-3 + 3e-3 - depth), 0.0, 1.0}};
  scene.instruments = {probe};
  return scene;
}

TEST(SceneAccuracy, IsThatOfAPressedBall) {
  const auto tissues = load_tissues(test::project_file("assets/tissues.json"));
  ASSERT_TRUE(tissues) << tissues.error().text();
  const auto accuracy = compare_with_half_spacing(pressed_ball(2e-3), *tissues);
  ASSERT_TRUE(accuracy) << accuracy.error().text();
  // Nodes farther apart than the tip is wide: some error, yet little, for the near field carries
  // the tip.
  EXPECT_GT(accuracy->force_error, 1e-5);
  EXPECT_LT(accuracy->force_error, 0.10);
  EXPECT_GT(accuracy->profile_error, 1e-5);
  EXPECT_LT(accuracy->profile_error, 0.20);
}

TEST(SceneAccuracy, IsPerfectWhereNothingIsTouched) {
  const auto tissues = load_tissues(test::project_file("assets/tissues.json"));
  ASSERT_TRUE(tissues) << tissues.error().text();
  const auto accuracy = compare_with_half_spacing(pressed_ball(-1e-3), *tissues);
  ASSERT_TRUE(accuracy) << accuracy.error().text();
  EXPECT_EQ(accuracy->force_error, 0.0);
  EXPECT_EQ(accuracy->profile_error, 0.0);
}

}  // namespace
}  // namespace viscera
