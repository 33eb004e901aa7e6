#include "engine/scene/soft_ball.h"

namespace viscera {

SceneDescription soft_ball_scene(double spacing, double finest) {
  SceneDescription scene;
  scene.file = "ball";
  scene.name = "ball";
  scene.duration = 2.0;
  OrganDescription ball;
  ball.response = Response::kLinear;
  ball.name = "ball";
  RecipeGeometry geometry;
  geometry.recipe = "sphere";
  geometry.radius = 25e-3;
  geometry.edge = 2.5e-3;
  ball.geometry = geometry;
  ball.tissue = "rubber";
  Region below;
  below.a = Vec3(0.0, 0.0, -15e-3);
  below.b = Vec3::UnitZ();
  ball.fixed = {below};
  ball.resolution.spacing = spacing;
  ball.resolution.finest = finest;
  scene.organs = {ball};
  return scene;
}

}  // namespace viscera
