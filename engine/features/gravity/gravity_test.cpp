// Organs that move as the table tilts and gravity with it.
#include "engine/features/gravity/gravity.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numbers>

#include "engine/features/breathing/breathing.h"
#include "engine/features/links/links.h"
#include "engine/simulator/build.h"
#include "kernels/finite/finite_solver.h"
#include "kernels/finite/unloaded_shape.h"
#include "tests/support/paths.h"
#include "tests/support/small_world.h"

namespace viscera::test {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;
constexpr double kRadius = 25e-3;  // of the ball
constexpr double kTip = 2e-3;

/// Level, with the head up by `degrees` from half a second on, and level again from one second on.
GravityDescription head_up(double degrees) {
  GravityDescription gravity;
  gravity.table = {{0.0, 0.0, 0.0},
                   {0.5, degrees * kDegree, 0.0},
                   {0.6, degrees * kDegree, 0.0},
                   {1.0, 0.0, 0.0}};
  return gravity;
}

SceneDescription tilted_ball(double degrees) {
  SceneDescription scene = soft_ball_scene(8e-3, 5e-3);
  scene.extras.set(head_up(degrees));
  return scene;
}

/// Displacement of the drawn vertex nearest to x, organ's frame [m].
Vec3 moved_at(const World& world, std::size_t organ, const Vec3& x) {
  const auto& rest = world.all<OrganBody>()[organ].model->rest_positions;
  const auto nearest =
      std::min_element(rest.begin(), rest.end(), [&](const Vec3f& a, const Vec3f& b) {
        return (a.cast<double>() - x).norm() < (b.cast<double>() - x).norm();
      });
  const auto v = static_cast<std::size_t>(nearest - rest.begin());
  return (world.all<OrganState>()[organ].positions[v] - rest[v]).cast<double>();
}

TEST(Gravity, TurnsWithTheTableAndIsNothingWhereItIsThatOfTheRestShapes) {
  const Gravity level(GravityDescription{});
  EXPECT_EQ(level.change_at(1.0), Vec3(0, 0, 0));
  const Gravity tilted(head_up(30.0));
  EXPECT_EQ(tilted.change_at(0.0), Vec3(0, 0, 0));
  EXPECT_LT((tilted.change_at(0.55) - 9.81 * Vec3(0, -0.5, 1.0 - std::cos(30 * kDegree))).norm(),
            1e-12);
  EXPECT_EQ(tilted.change_at(2.0), Vec3(0, 0, 0));
  GravityDescription rolled;
  rolled.table = {{0.0, 0.0, 90 * kDegree}};
  EXPECT_LT((Gravity(rolled).change_at(0.0) - Vec3(9.81, 0, 9.81)).norm(), 1e-12);
  // Imaged on the left side, operated on the back.
  GravityDescription turned;
  turned.rest_direction = Vec3::UnitX();
  EXPECT_LT((Gravity(turned).change_at(3.0) - Vec3(-9.81, 0, -9.81)).norm(), 1e-12);
}

TEST(Gravity, ATiltedTableMovesOrgansAndTiltingBackReturnsThemExactly) {
  const auto world = build(tilted_ball(30.0));
  ASSERT_TRUE(world);
  const OrganModel& model = *world->all<OrganBody>()[0].model;
  EXPECT_EQ(step_until(*world, 0.55), FlagSet());
  const Vec3 top = moved_at(*world, 0, Vec3(0, 0, kRadius));
  EXPECT_LT(top.y(), -0.5e-3);
  EXPECT_LT(std::abs(top.x()), 0.05 * std::abs(top.y()));
  EXPECT_LT(moved_at(*world, 0, Vec3(0, 0, -kRadius)).norm(), 0.05 * top.norm());
  EXPECT_GE(world->all<OrganState>()[0].greatest_displacement, top.norm());
  EXPECT_TRUE(world->all<OrganState>()[0].deformed);
  EXPECT_EQ(step_until(*world, 1.1), FlagSet());
  EXPECT_EQ(world->all<OrganState>()[0].positions, model.rest_positions);
  EXPECT_EQ(world->all<OrganState>()[0].normals, model.rest_normals);
  EXPECT_FALSE(world->all<OrganState>()[0].deformed);
}

constexpr double kLength = 60e-3;  // of the block [m]

/// Upright, held at its upper end.
SceneDescription held_block() {
  SceneDescription scene = soft_ball_scene(6e-3, 6e-3);
  scene.organs[0].geometry = block_geometry(Vec3(20e-3, 20e-3, kLength), 4e-3);
  Region top;
  top.a = Vec3(0, 0, 0.5 * kLength - 1e-6);
  top.b = -Vec3::UnitZ();
  scene.organs[0].fixed = {top};
  return scene;
}

TEST(Gravity, ABlockThatHangsWhereItStoodStretchesAsABarUnderTwiceItsWeight) {
  SceneDescription scene = held_block();
  scene.organs[0].poisson_ratio = 0.0;
  scene.extras.get<GravityDescription>().rest_direction = Vec3::UnitZ();
  const auto world = build(scene);
  ASSERT_TRUE(world);
  step_until(*world, 0.05);
  const double exact = test_tissues().at("rubber").density * 9.81 * kLength * kLength / 10e3;
  EXPECT_NEAR(moved_at(*world, 0, Vec3(0, 0, -0.5 * kLength)).z(), -exact, 0.02 * exact);
}

/// Hung from its upper end in its image, and level since.
SceneDescription hung_block(Response response, double youngs_modulus) {
  SceneDescription scene = held_block();
  OrganDescription& block = scene.organs[0];
  block.response = response;
  block.extras.set(HungInImage());
  block.youngs_modulus = youngs_modulus;
  scene.extras.set(GravityDescription());
  scene.instruments = {
      straight_tool("tip", InstrumentKind::kProbe, kTip, {{0.0, Vec3(0, 0, -33e-3), 0.0, 1.0}})};
  return scene;
}

double greatest_unloading(const World& world) {
  const auto& finite = world.all<OrganBody>()[0].model->finite;
  return finite ? farthest(finite->body().unloaded()) : 0.0;
}

TEST(Gravity, AnOrganAtFiniteStrainLiesInItsImageToTheLastBitThoughItWasStretchedThere) {
  const auto world = build(hung_block(Response::kFinite, 4e3));
  ASSERT_TRUE(world);
  // A bar's, about: rho g L^2 / (2 E).
  const double about = test_tissues().at("rubber").density * 9.81 * kLength * kLength / (2.0 * 4e3);
  EXPECT_NEAR(greatest_unloading(*world), about, 0.25 * about);
  EXPECT_EQ(step_until(*world, 0.3), FlagSet());
  EXPECT_EQ(world->all<OrganState>()[0].positions,
            world->all<OrganBody>()[0].model->rest_positions);
  EXPECT_FALSE(world->all<OrganState>()[0].deformed);
  EXPECT_EQ(greatest_unloading(*build(hung_block(Response::kLinear, 4e3))), 0.0)
      << "its answer is the same whatever bore it";
}

TEST(Gravity, AnOrganThatLayAmongOthersInItsImageHadNoStressThere) {
  SceneDescription scene = hung_block(Response::kFinite, 4e3);
  scene.organs[0].extras = {};
  const auto world = build(scene);
  ASSERT_TRUE(world);
  EXPECT_EQ(greatest_unloading(*world), 0.0);
}

TEST(Gravity, AnOrganTooSoftForItsWeightCountsAsFreeOfStressAndTheRunSaysSo) {
  const auto world = build(hung_block(Response::kFinite, 0.2e3));
  ASSERT_TRUE(world);
  EXPECT_EQ(greatest_unloading(*world), 0.0);
  const std::vector<std::string>& notes = world->all<OrganBody>()[0].model->notes;
  EXPECT_TRUE(std::ranges::any_of(notes, [](const std::string& note) {
    return note.starts_with("unloaded shape: ") &&
           note.find("raise youngs_modulus_kPa") != std::string::npos;
  }));
}

TEST(Gravity, PartsWeighWhatTheirDensitySays) {
  const auto sag_of = [](std::optional<double> density) {
    SceneDescription scene = tilted_ball(30.0);
    Region all;
    all.shape = Region::Shape::kSphere;
    all.radius = 1.0;
    if (density) scene.organs[0].parts = {{all, {}, density}};
    const auto world = build(scene);
    return world ? world->all<OrganBody>()[0].model->sag : std::vector<float>();
  };
  const std::vector<float> sag = sag_of({});
  const std::vector<float> heavy = sag_of(3.0 * test_tissues().at("rubber").density);
  ASSERT_FALSE(sag.empty());
  ASSERT_EQ(sag.size(), heavy.size());
  const float most = *std::max_element(sag.begin(), sag.end());
  for (std::size_t i = 0; i < sag.size(); ++i) ASSERT_NEAR(heavy[i], 3.0f * sag[i], 1e-4f * most);
}

TEST(Gravity, OnlyWhatItMovesIsPrepared) {
  const auto tilted = build(tilted_ball(30.0)), level = build(tilted_ball(0.0));
  auto scene = tilted_ball(30.0);
  scene.organs[0].extras.set(NeverSags());
  const auto stiff = build(scene);
  ASSERT_TRUE(tilted && level && stiff);
  EXPECT_FALSE(tilted->all<OrganBody>()[0].model->sag.empty());
  EXPECT_FALSE(tilted->all<OrganBody>()[0].model->touchable_anywhere());
  for (const World* world : {level.get(), stiff.get()}) {
    EXPECT_FALSE(world->all<OrganBody>()[0].model->deformable());
    EXPECT_EQ(world->all<OrganSag>().size(), 0u);
  }
}

TEST(Gravity, TheTurnOfAnOrgansFrameAndItsBreathDoNotMatter) {
  auto scene = tilted_ball(30.0);
  scene.organs.push_back(scene.organs[0]);
  scene.organs[1].name = "turned";
  scene.organs[1].pose.position.x() = 0.1;
  scene.organs[1].pose.orientation =
      Quaternion(Eigen::AngleAxisd(0.5 * std::numbers::pi, Vec3::UnitZ()));
  set_motion(scene.organs[1], {4e-3, -Vec3::UnitY(), 1.0, 0.0});
  const auto world = build(scene);
  ASSERT_TRUE(world);
  step_until(*world, 0.55);
  const Vec3 one = moved_at(*world, 0, Vec3(0, 0, kRadius));
  const Vec3 other =
      world->all<OrganPose>()[1].pose.direction_to_world(moved_at(*world, 1, Vec3(0, 0, kRadius)));
  EXPECT_LT((one - other).norm(), 0.05 * one.norm());
}

TEST(Gravity, ATipFeelsTheTissueThatComesToItAsItFeelsIndentation) {
  // Beside the ball, out of touch until it sags to the feet.
  const double gap = 0.5e-3, high = 10e-3;
  const double side = std::sqrt(kRadius * kRadius - high * high);
  const Vec3 outward = Vec3(0, -side, high) / kRadius;
  const Vec3 at = (kRadius + kTip + gap) * outward;
  auto scene = tilted_ball(60.0);
  scene.instruments = {straight_tool("tip", InstrumentKind::kProbe, kTip, {{0.0, at, 0.0, 1.0}})};
  const auto world = build(scene);
  ASSERT_TRUE(world);
  EXPECT_EQ(step_until(*world, 0.55), FlagSet());
  auto alone = scene;
  alone.instruments.clear();
  const auto free = build(alone);
  ASSERT_TRUE(free);
  step_until(*free, 0.55);
  const double depth = moved_at(*free, 0, kRadius * outward).dot(outward) - gap;
  ASSERT_GT(depth, 0.3e-3);
  // The same tip driven in by as much, at rest.
  auto pressed = soft_ball_scene(8e-3, 5e-3);
  pressed.instruments = {
      straight_tool("tip", InstrumentKind::kProbe, kTip,
                    {{0.0, at, 0.0, 1.0}, {0.5, at - (gap + depth) * outward, 0.0, 1.0}})};
  const auto other = build(pressed);
  ASSERT_TRUE(other);
  step_until(*other, 0.55);
  const double force = force_on(*other, 0).norm();
  EXPECT_GT(force, 1e-3);
  EXPECT_NEAR(force_on(*world, 0).norm(), force, 0.15 * force);
  step_until(*world, 1.1);
  EXPECT_EQ(force_on(*world, 0), Vec3(0, 0, 0));
  EXPECT_FALSE(world->all<OrganState>()[0].deformed);
}

TEST(Gravity, AJawThatClosesOnSaggingTissuePullsAtNothingAndHoldsItAgainstTilting) {
  const Vec3 top(0, 0, kRadius + kTip + 0.2e-3);
  auto scene = tilted_ball(20.0);
  scene.instruments = {
      straight_tool("jaw", InstrumentKind::kGrasper, kTip,
                    {{0.0, top, 0.0, 1.0}, {0.54, top, 0.0, 1.0}, {0.56, top, 0.0, 0.0}})};
  const auto world = build(scene);
  ASSERT_TRUE(world);
  step_until(*world, 0.59);
  ASSERT_TRUE(world->all<InstrumentContact>()[0].grasp);
  const Vec3 held = moved_at(*world, 0, Vec3(0, 0, kRadius));
  EXPECT_GT(held.norm(), 0.3e-3);
  EXPECT_LT(force_on(*world, 0).norm(), 1e-4);
  step_until(*world, 1.1);
  // Level again, but the jaw keeps the tissue where it took it.
  EXPECT_GT(force_on(*world, 0).norm(), 1e-2);
  EXPECT_LT((moved_at(*world, 0, Vec3(0, 0, kRadius)) - held).norm(), 0.1 * held.norm());
}

TEST(Gravity, AnOrganThatSagsDrawsTheOneThatItIsTiedTo) {
  constexpr double kGap = 1e-3;
  auto scene = tilted_ball(40.0);
  scene.organs.push_back(scene.organs[0]);
  scene.organs[1].name = "stiff";
  scene.organs[1].extras.set(NeverSags());
  scene.organs[1].pose.position.x() = 2.0 * kRadius + kGap;
  Region region;
  region.shape = Region::Shape::kSphere;
  region.a = Vec3(kRadius + 0.5 * kGap, 0.0, 0.0);
  region.radius = 8e-3;
  for (const bool turned : {false, true}) {
    LinkDescription bed{"bed", {"ball", "stiff"}, region, 300.0};
    if (turned) std::swap(bed.between[0], bed.between[1]);
    scene.extras.set(LinkDescriptions{bed});
    const auto world = build(scene);
    ASSERT_TRUE(world);
    EXPECT_EQ(step_until(*world, 0.55), FlagSet());
    EXPECT_LT(moved_at(*world, 1, Vec3(-kRadius, 0, 0)).y(), -0.02e-3);
    EXPECT_GT(world->all<LinkState>()[0].force, 1e-3);
    for (const LinkState::Spring& spring : world->all<LinkState>()[0].springs) {
      const Vec3 stretch = spring.displacements[1] - spring.displacements[0];
      EXPECT_LT((spring.force - stretch / world->all<Link>()[0].softness).norm(),
                1e-3 * world->all<LinkState>()[0].force);
    }
    step_until(*world, 1.1);
    for (const OrganState& organ : world->all<OrganState>()) EXPECT_FALSE(organ.deformed);
    EXPECT_EQ(world->all<LinkState>()[0].force, 0.0);
  }
}

TEST(Gravity, SagsBeyondWhatLinearElasticityDescribesAreWarnedOf) {
  auto scene = tilted_ball(60.0);
  std::vector<std::string> warnings;
  const PrepareOptions options{project_file("assets"), false};
  ASSERT_TRUE(build_world(scene, test_tissues(), options, no_progress(), warnings));
  EXPECT_TRUE(warnings.empty()) << warnings.front();
  scene.organs[0].youngs_modulus = 1e3;
  ASSERT_TRUE(build_world(scene, test_tissues(), options, no_progress(), warnings));
  ASSERT_EQ(warnings.size(), 1u);
  EXPECT_NE(warnings[0].find("organ \"ball\": the change of gravity moves it by"),
            std::string::npos)
      << warnings[0];
}

}  // namespace
}  // namespace viscera::test
