#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <limits>
#include <numbers>

#include "engine/features/contact/contact_flags.h"
#include "engine/features/deformation/deformation_flags.h"
#include "engine/run/state_hash.h"
#include "engine/simulation/controls.h"
#include "engine/simulator/build.h"
#include "tests/support/paths.h"
#include "tests/support/shapes.h"
#include "tests/support/small_world.h"

namespace viscera::test {
namespace {

constexpr double kTop = 25e-3;  // pole of the ball [m]

InstrumentKey key(double time, Vec3 tip, double jaw = 1.0) {
  return {time, tip, 0.0, jaw};
}

/// The soft ball with these spacings and a probe of this radius that sinks `depth` deep into its
/// pole within half a second.
SceneDescription pressed_ball_scene(double spacing, double finest, double radius, double depth) {
  auto scene = soft_ball_scene(spacing, finest);
  scene.instruments = {straight_tool(
      "probe", InstrumentKind::kProbe, radius,
      {key(0.0, Vec3(0, 0, kTop + radius + 1e-3)), key(0.5, Vec3(0, 0, kTop + radius - depth))})};
  return scene;
}

/// Comes to the pole with an open jaw, closes it and lifts 5 mm, all in 0.8 s.
InstrumentDescription lifting_grasper() {
  return straight_tool(
      "grasper", InstrumentKind::kGrasper, 2e-3,
      {key(0.0, Vec3(0, 0, kTop + 4e-3), 1.0), key(0.2, Vec3(0, 0, kTop + 1e-3), 1.0),
       key(0.4, Vec3(0, 0, kTop + 1e-3), 0.0), key(0.8, Vec3(0, 0, kTop + 6e-3), 0.0)});
}

TEST(Contact, AToolInTheAirFeelsNothingAndMovesNothing) {
  auto scene = soft_ball_scene(6e-3, 4e-3);
  scene.instruments = {
      straight_tool("probe", InstrumentKind::kProbe, 2e-3,
                    {key(0.0, Vec3(0, 0, kTop + 10e-3)), key(1.0, Vec3(5e-3, 0, kTop + 10e-3))})};
  auto world = build(scene);
  ASSERT_TRUE(world);
  step_until(*world, 1.0);
  EXPECT_EQ(force_on(*world, 0), Vec3::Zero());
  EXPECT_EQ(world->all<OrganState>()[0].version, 0u);
}

TEST(Contact, PressingPushesTheToolBackAndTheTissueOutOfItsWay) {
  const double radius = 4e-3, depth = 3e-3;
  auto world = build(pressed_ball_scene(6e-3, 3e-3, radius, depth));
  ASSERT_TRUE(world);
  EXPECT_EQ(but_for_strain(step_until(*world, 0.7)), FlagSet());
  const Vec3 force = force_on(*world, 0);
  EXPECT_GT(force.z(), 0.01);
  EXPECT_LT(force.head<2>().norm(), 0.05 * force.z());
  // No drawn vertex stays inside the tip by more than a tenth of the depth.
  const Vec3 centre = world->all<InstrumentState>()[0].tip;
  double deepest = 0.0;
  for (const Vec3f& p : world->all<OrganState>()[0].positions)
    deepest = std::max(deepest, radius - (p.cast<double>() - centre).norm());
  EXPECT_LT(deepest, 0.1 * depth);
}

TEST(Contact, HertzGivesTheForceOfAShallowPress) {
  const double radius = 5e-3, depth = 0.5e-3;
  auto world = build(pressed_ball_scene(5e-3, 2.5e-3, radius, depth));
  ASSERT_TRUE(world);
  step_until(*world, 0.7);
  // [Hertz1882] for two curved surfaces: the relative radius. The far side of the ball gives way a
  // little too, so the half-space formula is an upper bound within some per cent (contact
  // radius 1.4 mm, ball 25 mm).
  const double relative = 1.0 / (1.0 / radius + 1.0 / kTop);
  const double contact_modulus = 10e3 / (1.0 - 0.45 * 0.45);
  const double hertz = 4.0 / 3.0 * contact_modulus * std::sqrt(relative) * std::pow(depth, 1.5);
  EXPECT_NEAR(force_on(*world, 0).z() / hertz, 0.95, 0.10);
}

TEST(Contact, TheForceGoesWhenTheToolGoesAndTheBodyReturnsToRest) {
  auto scene = soft_ball_scene(6e-3, 4e-3);
  const double radius = 4e-3;
  scene.instruments = {straight_tool(
      "probe", InstrumentKind::kProbe, radius,
      {key(0.0, Vec3(0, 0, kTop + radius + 1e-3)), key(0.4, Vec3(0, 0, kTop + radius - 3e-3)),
       key(0.8, Vec3(0, 0, kTop + radius + 3e-3))})};
  auto world = build(scene);
  ASSERT_TRUE(world);
  step_until(*world, 0.4);
  EXPECT_GT(force_on(*world, 0).z(), 0.0);
  step_until(*world, 1.0);
  EXPECT_EQ(force_on(*world, 0), Vec3::Zero());
  EXPECT_EQ(world->all<OrganState>()[0].positions,
            world->all<OrganBody>()[0].model->rest_positions);
}

TEST(Contact, AClosedJawLiftsTissueAndIsPulledDown) {
  auto scene = soft_ball_scene(6e-3, 4e-3);
  scene.instruments = {lifting_grasper()};
  auto world = build(scene);
  ASSERT_TRUE(world);
  step_until(*world, 1.0);
  EXPECT_LT(force_on(*world, 0).z(), -0.01);
  float highest = 0.0f;
  for (const Vec3f& p : world->all<OrganState>()[0].positions) highest = std::max(highest, p.z());
  EXPECT_NEAR(highest, kTop + 5e-3, 1.0e-3);
}

TEST(Contact, AJawSlipsAboveItsGripLimit) {
  auto scene = soft_ball_scene(6e-3, 4e-3);
  auto grasper = lifting_grasper();
  grasper.grip_limit = 0.1;
  scene.instruments = {grasper};
  auto world = build(scene);
  ASSERT_TRUE(world);
  const FlagSet flags = step_until(*world, 1.0);
  EXPECT_TRUE(flags.has(kGripSlipped));
  EXPECT_NEAR(force_on(*world, 0).norm(), 0.1, 0.005);
}

TEST(Contact, AnOpenedJawLetsGo) {
  auto scene = soft_ball_scene(6e-3, 4e-3);
  scene.instruments = {
      straight_tool("grasper", InstrumentKind::kGrasper, 2e-3,
                    {key(0.0, Vec3(0, 0, kTop + 4e-3), 1.0), key(0.2, Vec3(0, 0, kTop + 1e-3), 1.0),
                     key(0.4, Vec3(0, 0, kTop + 1e-3), 0.0), key(0.6, Vec3(0, 0, kTop + 6e-3), 0.0),
                     key(0.8, Vec3(0, 0, kTop + 6e-3), 1.0)})};
  auto world = build(scene);
  ASSERT_TRUE(world);
  step_until(*world, 1.0);
  EXPECT_EQ(force_on(*world, 0), Vec3::Zero());
  EXPECT_FALSE(world->all<OrganState>()[0].deformed);
}

TEST(Contact, TwoToolsOnOneOrganFeelEachOther) {
  auto scene = soft_ball_scene(6e-3, 3.5e-3);
  const double radius = 3e-3, depth = 2e-3, apart = 5e-3;
  const auto pressing = [&](const char* name, double x) {
    const double surface = std::sqrt(kTop * kTop - x * x);
    return straight_tool(name, InstrumentKind::kProbe, radius,
                         {key(0.0, Vec3(x, 0, surface + radius + 1e-3)),
                          key(0.5, Vec3(x, 0, surface + radius - depth))});
  };
  scene.instruments = {pressing("left", -apart)};
  auto alone = build(scene);
  scene.instruments.push_back(pressing("right", apart));
  auto both = build(scene);
  ASSERT_TRUE(alone && both);
  step_until(*alone, 0.7);
  step_until(*both, 0.7);
  const double alone_force = force_on(*alone, 0).norm();
  const double left = force_on(*both, 0).norm(), right = force_on(*both, 1).norm();
  EXPECT_NEAR(left / right, 1.0, 0.03);
  // Each lowers the surface under the other as a force does a half-space's at a distance r, by
  // F (1 - nu^2) / (pi E r) [Johnson1985] ch. 3; so each feels what it would alone, so much less
  // deep.
  const double lowered = right * (1.0 - 0.45 * 0.45) / (std::numbers::pi * 10e3 * 2.0 * apart);
  Controls controls = controls_of_paths(*alone, alone->time());
  controls.tools[0].tip += lowered * Vec3(-apart, 0, std::sqrt(kTop * kTop - apart * apart)) / kTop;
  for (int frame = 0; frame < 20; ++frame) step_frame(*alone, controls, nullptr);
  const double shallower = force_on(*alone, 0).norm();
  RecordProperty("share_of_alone", std::to_string(left / alone_force));
  RecordProperty("share_by_half_space", std::to_string(shallower / alone_force));
  // A ball's surface isn't flat over r, 0.4 of its radius: a tenth of what the neighbour takes.
  const double taken = alone_force - shallower;
  EXPECT_GT(taken, 0.05 * alone_force);
  EXPECT_NEAR(left, shallower, 0.1 * taken);
}

TEST(Contact, OneToolPressesSeveralOrgansAtOnce) {
  auto scene = soft_ball_scene(7e-3, 4e-3);
  OrganDescription second = scene.organs[0];
  scene.organs[0].pose.position = Vec3(-25.2e-3, 0, 0);
  second.name = "other";
  second.pose.position = Vec3(25.2e-3, 0, 0);
  scene.organs.push_back(second);
  scene.instruments = {straight_tool("probe", InstrumentKind::kProbe, 8e-3,
                                     {key(0.0, Vec3(0, 0, 30e-3)), key(0.5, Vec3(0, 0, 17e-3))})};
  auto world = build(scene);
  ASSERT_TRUE(world);
  step_until(*world, 0.7);
  EXPECT_TRUE(world->all<OrganState>()[0].deformed);
  EXPECT_TRUE(world->all<OrganState>()[1].deformed);
  const Vec3 force = force_on(*world, 0);
  EXPECT_GT(force.z(), 0.0);
  EXPECT_LT(std::abs(force.x()), 0.05 * force.z());  // mirror images cancel sideways
}

TEST(Contact, InstancesOfOneOrganShareOneModel) {
  auto scene = soft_ball_scene(7e-3, 5e-3);
  OrganDescription second = scene.organs[0];
  second.name = "other";
  scene.organs[0].pose.position = Vec3(-40e-3, 0, 0);
  second.pose.position = Vec3(40e-3, 0, 0);
  scene.organs.push_back(second);
  auto world = build(scene);
  ASSERT_TRUE(world);
  EXPECT_EQ(world->all<OrganBody>()[0].model, world->all<OrganBody>()[1].model);
}

TEST(Contact, AnOrganThatNoToolCanReachIsNotPrepared) {
  auto scene = soft_ball_scene(7e-3, 5e-3);
  scene.instruments = {
      straight_tool("probe", InstrumentKind::kProbe, 2e-3, {key(0.0, Vec3(0, 0, 0.3))})};
  auto world = build(scene);
  ASSERT_TRUE(world);
  EXPECT_FALSE(world->all<OrganBody>()[0].model->deformable());
  EXPECT_EQ(world->all<OrganContact>().size(), 0u);
}

TEST(Contact, ACapsuleTouchesAlongItsLength) {
  auto scene = soft_ball_scene(6e-3, 4e-3);
  auto ball = straight_tool("ball", InstrumentKind::kProbe, 2e-3,
                            {key(0.0, Vec3(0, 0, kTop + 3e-3)), key(0.5, Vec3(0, 0, kTop + 1e-3))});
  auto bar = ball;
  bar.name = "bar";
  bar.tip.shape = TipDescription::Shape::kCapsule;
  bar.tip.length = 10e-3;
  bar.trocar = Vec3(0.2, 0, kTop + 1e-3);  // lies flat over the pole
  for (InstrumentKey& k : bar.path) k.tip.x() -= 5e-3;
  scene.instruments = {ball};
  auto with_ball = build(scene);
  scene.instruments = {bar};
  auto with_bar = build(scene);
  ASSERT_TRUE(with_ball && with_bar);
  step_until(*with_ball, 0.7);
  step_until(*with_bar, 0.7);
  EXPECT_GT(force_on(*with_bar, 0).z(), 1.3 * force_on(*with_ball, 0).z());
}

TEST(Contact, ATipThatStartsInsideAnOrganIsRefused) {
  auto scene = soft_ball_scene(7e-3, 5e-3);
  scene.instruments = {
      straight_tool("probe", InstrumentKind::kProbe, 2e-3, {key(0.0, Vec3(0, 0, kTop - 5e-3))})};
  std::vector<std::string> warnings;
  const auto world = build_world(scene, test_tissues(), {"", false}, no_progress(), warnings);
  ASSERT_FALSE(world);
  EXPECT_NE(world.error().text().find("instruments/0/path/0/tip_mm"), std::string::npos)
      << world.error().text();
  EXPECT_NE(world.error().text().find("\"ball\""), std::string::npos);
}

TEST(Contact, CancellingPreparationSaysSo) {
  auto scene = soft_ball_scene(7e-3, 4e-3);
  scene.instruments = {
      straight_tool("probe", InstrumentKind::kProbe, 2e-3, {key(0.0, Vec3(0, 0, kTop + 4e-3))})};
  std::vector<std::string> warnings;
  const Progress stop = [](double, std::string_view) { return false; };
  const auto world = build_world(scene, test_tissues(), {"", false}, stop, warnings);
  ASSERT_FALSE(world);
  EXPECT_EQ(world.error().text(), kCancelled);
}

TEST(Contact, ATipWhoseSideReachesIntoAnOrganAtTheStartIsRefusedToo) {
  auto scene = soft_ball_scene(7e-3, 5e-3);
  scene.instruments = {
      straight_tool("probe", InstrumentKind::kProbe, 4e-3, {key(0.0, Vec3(0, 0, kTop + 1e-3))})};
  std::vector<std::string> warnings;
  const auto world = build_world(scene, test_tissues(), {"", false}, no_progress(), warnings);
  ASSERT_FALSE(world);
  EXPECT_NE(world.error().text().find("3.0"), std::string::npos) << world.error().text();
}

TEST(Contact, AMeshTipPressesLikeTheBallThatItIs) {
  const double radius = 2e-3, depth = 1.5e-3;
  const TemporaryFolder folder;
  const TriangleSurface shape = icosphere(radius, 4);
  std::ofstream obj(folder / "tip.obj");
  for (const Vec3& v : shape.vertices) obj << "v " << v.x() << ' ' << v.y() << ' ' << v.z() << '\n';
  for (const auto& t : shape.triangles)
    obj << "f " << t[0] + 1 << ' ' << t[1] + 1 << ' ' << t[2] + 1 << '\n';
  obj.close();
  auto scene = soft_ball_scene(6e-3, 4e-3);
  scene.instruments = {straight_tool(
      "probe", InstrumentKind::kProbe, radius,
      {key(0.0, Vec3(0, 0, kTop + radius + 2e-3)), key(0.5, Vec3(0, 0, kTop + radius - depth))})};
  auto ball = build(scene);
  scene.instruments[0].tip.shape = TipDescription::Shape::kMesh;
  scene.instruments[0].tip.file = folder / "tip.obj";
  scene.instruments[0].tip.unit = 1.0;
  scene.instruments[0].tip.radius = 0.0;
  auto mesh = build(scene);
  ASSERT_TRUE(ball && mesh);
  step_until(*ball, 0.7);
  step_until(*mesh, 0.7);
  EXPECT_GT(force_on(*mesh, 0).z(), 0.0);
  EXPECT_NEAR(force_on(*mesh, 0).z() / force_on(*ball, 0).z(), 1.0, 0.05);
}

TEST(Contact, AJawThatClosesWithinItsGripRadiusHoldsAndOneFartherOffIsReported) {
  auto scene = soft_ball_scene(6e-3, 4e-3);
  const auto closing_at = [&](double gap) {
    auto tool = straight_tool("grasper", InstrumentKind::kGrasper, 2e-3,
                              {key(0.0, Vec3(0, 0, kTop + 2e-3 + gap), 1.0),
                               key(0.3, Vec3(0, 0, kTop + 2e-3 + gap), 0.0)});
    tool.grip_radius = 4e-3;
    scene.instruments = {tool};
    return build(scene);
  };
  auto near = closing_at(3e-3);
  auto far = closing_at(5e-3);
  ASSERT_TRUE(near && far);
  EXPECT_FALSE(step_until(*near, 0.5).has(kGripMissed));
  EXPECT_TRUE(near->all<InstrumentContact>()[0].grasp.has_value());
  EXPECT_TRUE(step_until(*far, 0.5).has(kGripMissed));
  EXPECT_FALSE(far->all<InstrumentContact>()[0].grasp.has_value());
}

TEST(Contact, ANonFiniteDisplacementFreezesTheOrganAtItsLastShape) {
  auto world = build(pressed_ball_scene(6e-3, 4e-3, 4e-3, 3e-3));
  ASSERT_TRUE(world);
  step_until(*world, 0.4);
  EXPECT_GT(force_on(*world, 0).z(), 0.0);
  const auto shape = world->all<OrganState>()[0].positions;
  // A row of the compliance that contact itself doesn't read: of the place farthest below.
  auto& model = const_cast<OrganModel&>(*world->all<OrganBody>()[0].model);
  SurfaceCompliance& compliance = model.compliance;
  const auto lowest =
      std::ranges::min_element(model.places.positions, {}, [](const Vec3& x) { return x.z(); });
  const auto row = static_cast<std::size_t>(lowest - model.places.positions.begin());
  for (std::size_t c = 0; c < 3 * compliance.touchable.size(); ++c)
    compliance.columns[c * compliance.rows() + 3 * row] = std::numeric_limits<float>::quiet_NaN();
  EXPECT_TRUE(step_until(*world, 0.45).has(kOrganFrozen));
  EXPECT_EQ(world->all<OrganState>()[0].positions, shape);
  EXPECT_EQ(force_on(*world, 0), Vec3::Zero());
  EXPECT_TRUE(step_until(*world, 0.6).has(kOrganFrozen));
}

TEST(Contact, HalfPrecisionMovesTheSurfaceWithinItsErrorAndLeavesTheForce) {
  auto scene = pressed_ball_scene(6e-3, 4e-3, 4e-3, 3e-3);
  auto single = build(scene);
  scene.organs[0].displacement_storage = DisplacementStorage::kHalf;
  auto half = build(scene);
  ASSERT_TRUE(single && half);
  // The first contact is found on the surface at rest, and so is the same.
  while (force_on(*single, 0).isZero(0.0) && single->time() < 0.5) {
    step_until(*single, single->time() + 1.0 / 60.0);
    step_until(*half, half->time() + 1.0 / 60.0);
  }
  ASSERT_GT(force_on(*single, 0).z(), 0.0);
  const OrganModel& exact = *single->all<OrganBody>()[0].model;
  const OrganModel& model = *half->all<OrganBody>()[0].model;
  EXPECT_EQ(force_part(exact.compliance).columns, model.compliance.columns);
  // The same numbers, which lie apart in one and together in the other: sums in single precision.
  EXPECT_LT((force_on(*half, 0) - force_on(*single, 0)).norm(), 1e-6 * force_on(*single, 0).norm());
  ASSERT_TRUE(model.in_half_precision());
  EXPECT_LT(model.half_columns.error, 0x1p-11 * 1.001);
  EXPECT_EQ(static_cast<std::ptrdiff_t>(exact.memory_bytes()) -
                static_cast<std::ptrdiff_t>(model.memory_bytes()),
            model.saved_bytes());
  double greatest = 0.0, loads = 0.0;
  for (const float entry : exact.compliance.columns)
    greatest = std::max(greatest, static_cast<double>(std::abs(entry)));
  for (const Vec3& load : half->all<OrganContact>()[0].response.loads)
    loads += load.cwiseAbs().sum();
  const auto& unknowns = half->all<OrganState>()[0].displacements;
  const auto& wanted = single->all<OrganState>()[0].displacements;
  ASSERT_EQ(unknowns.size(), wanted.size());
  for (std::size_t i = 0; i < unknowns.size(); ++i)
    ASSERT_NEAR(unknowns[i], wanted[i], (model.half_columns.error + 1e-5) * greatest * loads);

  // Later contacts are found on the moved surface: its error, over the depth, times the 3/2 of
  // [Hertz1882] in the force, and as much again for what the frames before did.
  step_until(*single, 0.5);
  step_until(*half, 0.5);
  const double force = force_on(*single, 0).norm();
  EXPECT_NEAR(force_on(*half, 0).norm(), force, 0.01 * force);
}

TEST(Contact, AContactWithoutSolutionKeepsTheShapeAndGivesNoForce) {
  auto world = build(pressed_ball_scene(6e-3, 4e-3, 4e-3, 3e-3));
  ASSERT_TRUE(world);
  const auto shape = world->all<OrganState>()[0].positions;
  auto& columns = const_cast<OrganModel&>(*world->all<OrganBody>()[0].model).compliance.columns;
  for (float& value : columns) value = std::numeric_limits<float>::quiet_NaN();
  EXPECT_TRUE(step_until(*world, 0.4).has(kContactNotConverged));
  EXPECT_EQ(world->all<OrganState>()[0].positions, shape);
  EXPECT_EQ(force_on(*world, 0), Vec3::Zero());
}

TEST(Contact, ATipThatLeavesItsPathIsAnswered) {
  auto scene = soft_ball_scene(6e-3, 4e-3);
  scene.instruments = {
      straight_tool("probe", InstrumentKind::kProbe, 2e-3,
                    {key(0.0, Vec3(0, 0, kTop + 4e-3)), key(0.2, Vec3(0, 0, kTop + 1e-3))})};
  auto world = build(scene);
  ASSERT_TRUE(world);
  // The tool goes where its key frames never led it.
  Controls controls = controls_of_paths(*world, 0.0);
  controls.tools[0].tip = Vec3(kTop + 1e-3, 0, 0);
  FlagSet flags;
  for (int frame = 0; frame < 6; ++frame) flags.raise(step_frame(*world, controls, nullptr).flags);
  EXPECT_TRUE(flags.empty());
  EXPECT_GT(force_on(*world, 0).x(), 1e-3);
}

}  // namespace
}  // namespace viscera::test
