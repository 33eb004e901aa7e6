#include "engine/features/free_bodies/block_on_floor.h"

#include "engine/features/gravity/gravity_keys.h"
#include "engine/features/touching/touching_keys.h"

namespace viscera {

SceneDescription block_on_floor(const BlockOnFloor& options) {
  const Vec3 size(30e-3, 30e-3, 15e-3), floor(100e-3, 400e-3, 20e-3);
  SceneDescription scene;
  scene.file = scene.name = "block_on_floor";
  scene.duration = 2.0;
  OrganDescription block;
  block.name = "block";
  RecipeGeometry geometry;
  geometry.recipe = "block";
  geometry.size = size;
  geometry.edge = 2.5e-3;
  block.geometry = geometry;
  block.tissue = "rubber";
  block.pose.position.z() = 0.5 * size.z() + options.above;
  block.resolution.spacing = block.resolution.finest = options.spacing;
  block.free = true;
  OrganDescription ground;
  ground.name = "floor";
  geometry.size = floor;
  geometry.edge = 20e-3;
  ground.geometry = geometry;
  ground.tissue = "rubber";
  ground.pose.position.z() = -0.5 * floor.z();
  ground.deformable = false;
  scene.organs = {block, ground};
  scene.extras.set(
      TouchingDescription{.organs = true, .friction = options.friction, .pitch = options.pitch});
  scene.extras.set(GravityDescription{.table = {{.head_up = options.slope}}});
  return scene;
}

}  // namespace viscera
