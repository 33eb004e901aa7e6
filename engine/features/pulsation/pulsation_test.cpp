#include "engine/features/pulsation/pulsation.h"

#include <gtest/gtest.h>

#include "engine/scene/load_scene.h"
#include "engine/simulator/simulation.h"
#include "tests/support/small_world.h"

namespace viscera {
namespace {

/// The soft ball, its lower half held, that swells by a twentieth once a second.
SceneDescription beating_ball(double strain = 0.05) {
  SceneDescription scene = soft_ball_scene(6e-3, 5e-3);
  scene.organs[0].extras.set(PulsationDescription{.strain = strain, .rate = 1.0});
  scene.duration = 2.0;
  return scene;
}

double height(const World& world) {
  double top = 0.0;
  for (const Vec3f& p : world.all<OrganState>()[0].positions)
    top = std::max(top, static_cast<double>(p.z()));
  return top;
}

TEST(Pulsation, SwellsTheSurfaceByItsStrainInTheMiddleOfABeat) {
  const auto world = test::build(beating_ball());
  ASSERT_TRUE(world);
  const double rest = height(*world);
  test::step_until(*world, 0.5);
  const double middle = world->all<OrganBody>()[0].model->rest_bounds.center().z();
  EXPECT_NEAR((height(*world) - rest) / (rest - middle), 0.05, 5e-4);
}

TEST(Pulsation, IsBackAtRestAfterAWholeBeat) {
  const auto world = test::build(beating_ball());
  ASSERT_TRUE(world);
  const double rest = height(*world);
  test::step_until(*world, 1.0);
  EXPECT_NEAR(height(*world), rest, 1e-9);
}

TEST(Pulsation, LeavesTissueThatIsHeldWhereItIs) {
  const SceneDescription scene = beating_ball();
  const auto world = test::build(scene);
  ASSERT_TRUE(world);
  test::step_until(*world, 0.5);
  const OrganModel& model = *world->all<OrganBody>()[0].model;
  const std::vector<Vec3f>& now = world->all<OrganState>()[0].positions;
  std::size_t held = 0;
  for (std::size_t v = 0; v < now.size(); ++v) {
    const Vec3 rest = model.rest_positions[v].cast<double>();
    bool deep = false;
    for (const Region& region : scene.organs[0].fixed)
      deep = deep || region.grown(-8e-3).contains(rest);
    if (!deep) continue;
    ++held;
    EXPECT_LT((now[v] - model.rest_positions[v]).norm(), 1e-6f);
  }
  EXPECT_GT(held, 10u);
}

TEST(Pulsation, PushesAProbeThatTouches) {
  SceneDescription scene = beating_ball();
  const double top = 25e-3;
  scene.instruments = {test::straight_tool("probe", InstrumentKind::kProbe, 3e-3,
                                           {{0.0, Vec3(0, 0, top + 3.2e-3), 0.0, 1.0}})};
  const auto world = test::build(scene);
  ASSERT_TRUE(world);
  test::step_until(*world, 0.1);
  EXPECT_EQ(test::force_on(*world, 0).norm(), 0.0);
  test::step_until(*world, 0.5);
  EXPECT_GT(test::force_on(*world, 0).z(), 1e-3);
}

double volume(const World& world) {
  const OrganModel& model = *world.all<OrganBody>()[0].model;
  double six = 0.0;
  for (const auto& corners : model.surface.triangles) {
    const auto corner = [&](std::size_t c) {
      return Vec3(world.all<OrganState>()[0]
                      .positions[static_cast<std::size_t>(corners[c])]
                      .cast<double>());
    };
    six += corner(0).dot(corner(1).cross(corner(2)));
  }
  return six / 6.0;
}

TEST(Pulsation, AtFiniteStrainTissueSwellsAgainstWhatHoldsItAndGoesBack) {
  SceneDescription scene = beating_ball();
  scene.organs[0].response = Response::kFinite;
  const auto world = test::build(scene);
  ASSERT_TRUE(world);
  const double rest = volume(*world), top = height(*world);
  test::step_until(*world, 0.5);
  // Tissue hardly gives way in volume: what the hold keeps from going aside goes up.
  const double grown = volume(*world) / rest - 1.0, alone = 1.05 * 1.05 * 1.05 - 1.0;
  EXPECT_GT(grown, 0.93 * alone);
  EXPECT_LT(grown, 1.0 * alone);
  EXPECT_GT(height(*world) - top, 1.2 * 0.05 * top);
  test::step_until(*world, 1.0);
  EXPECT_NEAR(height(*world), top, 0.02e-3);
}

TEST(Pulsation, AtFiniteStrainItPushesAProbeThatTouches) {
  SceneDescription scene = beating_ball();
  scene.organs[0].response = Response::kFinite;
  scene.instruments = {test::straight_tool("probe", InstrumentKind::kProbe, 3e-3,
                                           {{0.0, Vec3(0, 0, 25e-3 + 3.2e-3), 0.0, 1.0}})};
  const auto world = test::build(scene);
  ASSERT_TRUE(world);
  test::step_until(*world, 0.5);
  EXPECT_GT(test::force_on(*world, 0).z(), 1e-3);
}

TEST(Pulsation, ARunAtFiniteStrainGoesOnFromASnapshotToTheSameBits) {
  SceneDescription scene = beating_ball();
  scene.organs[0].response = Response::kFinite;
  const Model model = test::build_shared(scene);
  auto whole = Simulation::create(model), other = Simulation::create(model);
  ASSERT_TRUE(whole && other);
  const auto step_to = [](Simulation& simulation, std::uint64_t frame) {
    while (simulation.frame() < frame) simulation.step();
  };
  step_to(*whole, 17);
  const auto snapshot = whole->snapshot();
  ASSERT_TRUE(snapshot) << snapshot.error().text();
  step_to(*whole, 24);
  step_to(*other, 40);  // it has lived another life
  ASSERT_TRUE(other->restore(*snapshot));
  step_to(*other, 24);
  EXPECT_EQ(other->hash(), whole->hash()) << other->world().state_difference(whole->world());
}

TEST(Pulsation, WithoutStrainIsARunWithoutIt) {
  SceneDescription plain = beating_ball();
  plain.organs[0].extras = {};
  const auto still = test::build(beating_ball(0.0)), none = test::build(plain);
  ASSERT_TRUE(still && none);
  test::step_until(*still, 0.3);
  test::step_until(*none, 0.3);
  EXPECT_EQ(still->all<OrganState>()[0].positions, none->all<OrganState>()[0].positions);
}

}  // namespace
}  // namespace viscera
