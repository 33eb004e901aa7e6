#include "engine/features/free_bodies/block_between_plates.h"

#include "engine/features/breathing/breathing_keys.h"
#include "engine/features/touching/touching_keys.h"

namespace viscera {

SceneDescription block_between_plates(const BlockBetweenPlates& options) {
  constexpr double kThick = 20e-3, kEdge = 20e-3;
  SceneDescription scene;
  scene.file = scene.name = "block_between_plates";
  scene.duration = options.time;
  RecipeGeometry geometry;
  geometry.recipe = "block";
  geometry.size = Vec3(kPressedBlockSide, kPressedBlockSide, kPressedBlockHeight);
  geometry.edge = 2.5e-3;
  OrganDescription block;
  block.name = "block";
  block.geometry = geometry;
  block.tissue = "rubber";
  block.pose.position.z() = 0.5 * kPressedBlockHeight;
  block.resolution.spacing = block.resolution.finest = options.spacing;
  block.free = true;
  OrganDescription floor;
  floor.name = "floor";
  geometry.size = Vec3(100e-3, 100e-3, kThick);
  geometry.edge = kEdge;
  floor.geometry = geometry;
  floor.tissue = "rubber";
  floor.pose.position.z() = -0.5 * kThick;
  floor.deformable = false;
  OrganDescription plate = floor;
  plate.name = "plate";
  plate.pose.position.z() = kPressedBlockHeight + 0.5 * kThick;
  if (options.press > 0.0)
    set_motion(plate, {.amplitude = options.press,
                       .direction = -Vec3::UnitZ(),
                       .period = 2.0 * options.time,
                       .phase = 0.0});
  scene.organs = {block, floor, plate};
  scene.extras.set(TouchingDescription{.organs = true, .friction = 0.0, .pitch = options.pitch});
  return scene;
}

}  // namespace viscera
