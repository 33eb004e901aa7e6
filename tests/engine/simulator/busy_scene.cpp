#include "tests/engine/simulator/busy_scene.h"

#include "engine/features/breathing/breathing.h"
#include "engine/features/gas/gas.h"
#include "engine/features/gravity/gravity.h"
#include "engine/features/links/links.h"
#include "engine/features/pulsation/pulsation.h"
#include "engine/features/smoke/smoke.h"
#include "tests/support/small_world.h"

namespace viscera::test {
namespace {

constexpr double kTop = 25e-3;  // pole of the ball [m]

}  // namespace

SceneDescription busy_scene() {
  SceneDescription scene = soft_ball_scene(9e-3, 6e-3);
  scene.name = "busy";
  scene.source = "busy";
  OrganDescription other = scene.organs[0];
  other.name = "other";
  other.pose.position = Vec3(52e-3, 0, 0);
  other.extras.set(PulsationDescription{.strain = 0.01, .rate = 1.0});
  set_motion(other, {.amplitude = 2e-3});
  scene.organs.push_back(other);
  LinkDescription link;
  link.name = "band";
  link.between = {scene.organs[0].name, "other"};
  link.region.shape = Region::Shape::kSphere;
  link.region.a = Vec3(26e-3, 0, 0);
  link.region.radius = 8e-3;
  link.stiffness = 50.0;
  scene.extras.set(LinkDescriptions{link});
  scene.instruments = {straight_tool("hook", InstrumentKind::kHook, 1e-3,
                                     {{0.0, Vec3(0, 0, kTop + 1.5e-3), 30.0, 1.0},
                                      {0.2, Vec3(0, 0, kTop + 0.5e-3), 30.0, 1.0},
                                      {1.5, Vec3(3e-3, 0, kTop - 0.3e-3), 30.0, 1.0}}),
                       straight_tool("grasper", InstrumentKind::kGrasper, 2e-3,
                                     {{0.0, Vec3(-20e-3, 0, 20e-3), 0.0, 1.0},
                                      {0.3, Vec3(-17.5e-3, 0, 18e-3), 0.0, 0.0},
                                      {1.5, Vec3(-22e-3, 0, 24e-3), 0.0, 0.0}})};
  scene.instruments[0].friction = 0.2;
  SmokeDescription smoke;
  smoke.name = "plume";
  smoke.domain = Box(Vec3(-30e-3, -30e-3, 15e-3), Vec3(30e-3, 30e-3, 60e-3));
  EmitterDescription steady;
  steady.position = Vec3(10e-3, 0, kTop + 5e-3);
  steady.rate = 2e-6;
  steady.particles = 900;
  EmitterDescription burn;
  burn.instrument = "hook";
  smoke.emitters = {steady, burn};
  scene.extras.set(SmokeDescriptions{smoke});
  GasDescription& gas = scene.extras.get<GasDescription>();
  gas.cells = 12;
  gas.inlets = {{Vec3(-25e-3, 0, 40e-3), Vec3::UnitX(), 3e-3, 5e-5, {}}};
  scene.extras.get<GravityDescription>().table = {{0.0, 0.0, 0.0}, {1.0, 0.2, 0.1}};
  scene.duration = 1.5;
  return scene;
}

const Model& busy_model() {
  static const Model model = build_shared(busy_scene());
  return model;
}

}  // namespace viscera::test
