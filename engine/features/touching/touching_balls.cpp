#include "engine/features/touching/touching_balls.h"

#include "engine/features/breathing/breathing_keys.h"
#include "engine/features/touching/touching_keys.h"
#include "engine/scene/soft_ball.h"

namespace viscera {

SceneDescription touching_balls(double approach, Response response, const BallFineness& fineness) {
  constexpr double kRadius = 25e-3;
  SceneDescription scene = soft_ball_scene(6e-3, 3e-3);
  scene.file = scene.name = "touching_balls";
  scene.organs[0].response = response;
  std::get<RecipeGeometry>(scene.organs[0].geometry).edge = fineness.edge;
  Region pole;
  pole.shape = Region::Shape::kSphere;
  pole.radius = 10e-3;
  pole.a = Vec3(0, 0, kRadius);
  scene.organs[0].resolution.fine = {pole};
  Region half;
  half.a = Vec3::Zero();
  half.b = Vec3::UnitZ();
  scene.organs[0].fixed = {half};
  scene.organs.push_back(scene.organs[0]);
  scene.organs[0].name = "lower";
  OrganDescription& upper = scene.organs[1];
  upper.name = "upper";
  upper.pose.position.z() = 2.0 * kRadius;
  upper.fixed[0].b = -half.b;
  upper.resolution.fine[0].a = -pole.a;
  if (approach > 0.0)
    set_motion(upper, {.amplitude = approach,
                       .direction = -Vec3::UnitZ(),
                       .period = 2.0 * kBallsNearest,
                       .phase = 0.0});
  scene.extras.set(TouchingDescription{.organs = true, .pitch = fineness.pitch});
  return scene;
}

}  // namespace viscera
