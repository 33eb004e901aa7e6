#include "engine/features/free_bodies/block_between_plates.h"

#include "engine/features/breathing/breathing_keys.h"
#include "engine/features/free_bodies/rubber_organs.h"
#include "engine/features/touching/touching_keys.h"

namespace viscera {

SceneDescription block_between_plates(const BlockBetweenPlates& options) {
  constexpr double kThick = 20e-3, kHalf = 50e-3;
  SceneDescription scene;
  scene.file = scene.name = "block_between_plates";
  scene.duration = options.time;
  RecipeGeometry geometry;
  geometry.recipe = "block";
  geometry.size = Vec3(kPressedBlockSide, kPressedBlockSide, kPressedBlockHeight);
  geometry.edge = 2.5e-3;
  const OrganDescription block =
      free_rubber("block", geometry, Vec3(0.0, 0.0, 0.5 * kPressedBlockHeight), options.spacing);
  const auto still = [&](const std::string& name, double under) {
    return still_block(name, {-kHalf, -kHalf, under}, {kHalf, kHalf, under + kThick});
  };
  const OrganDescription floor = still("floor", -kThick);
  OrganDescription plate = still("plate", kPressedBlockHeight);
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
