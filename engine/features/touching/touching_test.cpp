// Organs that touch each other.
#include "engine/features/touching/touching.h"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>

#include "engine/features/breathing/breathing_keys.h"
#include "engine/features/links/links.h"
#include "engine/run/state_hash.h"
#include "engine/simulator/build.h"
#include "engine/verification/two_balls.h"
#include "tests/support/paths.h"
#include "tests/support/small_world.h"

namespace viscera::test {
namespace {

constexpr double kRadius = 25e-3;
constexpr double kHalfBreath = 0.5;  // [s]

Region half_space(double direction) {
  Region region;
  region.a = Vec3::Zero();
  region.b = Vec3(0, 0, direction);
  return region;
}

/// Two balls that touch, each held in its half away from the other; the upper one goes down by
/// `approach` within kHalfBreath.
SceneDescription balls(double approach, Response response) {
  SceneDescription scene = soft_ball_scene(6e-3, 3e-3);
  scene.organs[0].response = response;
  Region fine;
  fine.shape = Region::Shape::kSphere;
  fine.radius = 10e-3;
  fine.a = Vec3(0, 0, kRadius);
  scene.organs[0].resolution.fine = {fine};
  scene.organs[0].fixed = {half_space(1.0)};
  scene.organs.push_back(scene.organs[0]);
  scene.organs[0].name = "lower";
  OrganDescription& upper = scene.organs[1];
  upper.name = "upper";
  upper.pose.position.z() = 2.0 * kRadius;
  upper.fixed = {half_space(-1.0)};
  upper.resolution.fine[0].a = -fine.a;
  set_motion(upper, {.amplitude = approach,
                     .direction = -Vec3::UnitZ(),
                     .period = 2.0 * kHalfBreath,
                     .phase = 0.0});
  scene.extras.set(TouchingDescription{true, 0.0});
  return scene;
}

/// Of all cells of an organ, world [N].
Vec3 pressed(const World& world, std::size_t organ) {
  Vec3 sum = Vec3::Zero();
  for (const Vec3& force : world.all<OrganContact>()[organ].solution.forces) sum += force;
  return pose_of(world, world.model().organs()[organ]).direction_to_world(sum);
}

class TouchingBalls : public testing::TestWithParam<Response> {};

TEST_P(TouchingBalls, PressEachOtherAsHertzFoundAndEquallyHard) {
  const double approach = 1.5e-3;
  auto world = build(balls(approach, GetParam()));
  ASSERT_TRUE(world);
  EXPECT_EQ(but_for_strain(step_until(*world, kHalfBreath)), FlagSet());
  const IsotropicMaterial material = world->all<OrganBody>()[0].model->material;
  const auto give = give_of_base(material, kRadius);
  ASSERT_TRUE(give);
  const double exact = hertz_held(material, kRadius, approach, *give).force;
  const Vec3 below = pressed(*world, 0), above = pressed(*world, 1);
  // Patches 1.5 mm apart under a disc of 4 mm.
  EXPECT_NEAR(-below.z(), exact, 0.08 * exact);
  EXPECT_LT((below + above).norm(), 1e-6 * above.norm());
  EXPECT_LT(world->one<TouchingFigures>()->greatest_overlap, 0.2e-3);
}
INSTANTIATE_TEST_SUITE_P(Responses, TouchingBalls,
                         testing::Values(Response::kLinear, Response::kFinite),
                         [](const auto& info) {
                           return std::string(info.param == Response::kLinear ? "Linear"
                                                                              : "Finite");
                         });

}  // namespace
}  // namespace viscera::test
