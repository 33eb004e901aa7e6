#include "tests/support/smoking_ball.h"

#include "engine/features/gas/gas_keys.h"
#include "engine/features/smoke/smoke_keys.h"
#include "engine/scene/soft_ball.h"

namespace viscera::test {

SceneDescription smoking_ball_scene() {
  SceneDescription scene = soft_ball_scene(8e-3, 5e-3);
  EmitterDescription emitter;
  emitter.position = Vec3(0, 0, 31e-3);
  emitter.rate = 2e-6;
  emitter.particles = 600;
  SmokeDescription smoke;
  smoke.name = "plume";
  smoke.domain = Box(Vec3(-40e-3, -40e-3, -30e-3), Vec3(40e-3, 40e-3, 90e-3));
  smoke.emitters = {emitter};
  scene.extras.set(SmokeDescriptions{smoke});
  scene.extras.get<GasDescription>().cells = 16;
  return scene;
}

}  // namespace viscera::test
