#include "engine/features/free_bodies/block_on_floor.h"

#include "engine/features/free_bodies/rubber_organs.h"
#include "engine/features/gravity/gravity_keys.h"
#include "engine/features/touching/touching_keys.h"

namespace viscera {

SceneDescription block_on_floor(const BlockOnFloor& options) {
  const Vec3 size(30e-3, 30e-3, 15e-3);
  SceneDescription scene;
  scene.file = scene.name = "block_on_floor";
  scene.duration = 2.0;
  RecipeGeometry geometry;
  geometry.recipe = "block";
  geometry.size = size;
  geometry.edge = 2.5e-3;
  scene.organs = {free_rubber("block", geometry, Vec3(0.0, 0.0, 0.5 * size.z() + options.above),
                              options.spacing),
                  still_block("floor", {-50e-3, -200e-3, -20e-3}, {50e-3, 200e-3, 0.0})};
  scene.extras.set(
      TouchingDescription{.organs = true, .friction = options.friction, .pitch = options.pitch});
  scene.extras.set(GravityDescription{.table = {{.head_up = options.slope}}});
  return scene;
}

}  // namespace viscera
