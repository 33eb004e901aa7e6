// Organs that elastic links tie to each other.
#include "engine/features/links/links.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>

#include "engine/features/breathing/breathing.h"
#include "engine/run/state_hash.h"
#include "engine/simulator/build.h"
#include "tests/support/paths.h"
#include "tests/support/small_world.h"

namespace viscera::test {
namespace {

constexpr double kRadius = 25e-3;
constexpr double kGap = 1e-3;
constexpr double kTip = 2e-3;  // of a jaw [m]
/// Where a jaw closes on top of a ball.
constexpr double kHigh = kRadius + kTip + 0.2e-3;
constexpr double kApart = 2.0 * kRadius + kGap;

/// Two balls beside each other along x, tied where they are nearest.
SceneDescription two_balls(double stiffness) {
  SceneDescription scene = soft_ball_scene(8e-3, 5e-3);
  scene.organs.push_back(scene.organs[0]);
  scene.organs[0].name = "one";
  scene.organs[1].name = "other";
  scene.organs[1].pose.position.x() = kApart;
  Region region;
  region.shape = Region::Shape::kSphere;
  region.a = Vec3(kRadius + 0.5 * kGap, 0.0, 0.0);
  region.radius = 8e-3;
  scene.extras.set(LinkDescriptions{{"bed", {"one", "other"}, region, stiffness}});
  return scene;
}

/// A jaw that closes at the top of a ball within a tenth of a second and then goes by `ways`, one
/// each tenth of a second.
InstrumentDescription jaw(const std::string& name, double x, const std::vector<Vec3>& ways) {
  const Vec3 top(x, 0.0, kHigh);
  std::vector<InstrumentKey> keys = {{0.0, top, 0.0, 1.0}, {0.1, top, 0.0, 0.0}};
  for (std::size_t i = 0; i < ways.size(); ++i)
    keys.push_back({0.2 + 0.1 * static_cast<double>(i), top + ways[i], 0.0, 0.0});
  auto tool = straight_tool(name, InstrumentKind::kGrasper, kTip, keys);
  tool.grip_limit = 100.0;
  return tool;
}

/// Two balls, the first under a jaw that lifts it: with their link, and without.
struct TiedAndLoose {
  TiedAndLoose(double stiffness, double lift) {
    auto scene = two_balls(stiffness);
    scene.instruments = {jaw("jaw", 0.0, {Vec3(0, 0, lift)})};
    tied = build(scene);
    scene.extras.remove<LinkDescriptions>();
    loose = build(scene);
  }
  std::unique_ptr<World> tied, loose;
};

/// Mean displacement of an organ's drawn surface near x (its own frame), in its frame.
Vec3 moved_near(const World& world, std::size_t organ, const Vec3& x) {
  Vec3 sum = Vec3::Zero();
  int count = 0;
  const OrganModel& model = *world.all<OrganBody>()[organ].model;
  for (std::size_t v = 0; v < model.rest_positions.size(); ++v) {
    if ((model.rest_positions[v].cast<double>() - x).norm() > 5e-3) continue;
    sum += (world.all<OrganState>()[organ].positions[v] - model.rest_positions[v]).cast<double>();
    ++count;
  }
  return count > 0 ? Vec3(sum / count) : sum;
}

std::string hash_after(World& world, double time) {
  Trace trace(stage_names());
  StateHash hash;
  while (world.time() < time - 1e-9) {
    step_frame(world, trace);
    hash.add_frame(world);
  }
  return hash.finish(world);
}

/// Greatest misfit of f = k (u_B + shift - u_A) over all springs, over the greatest force.
double misfit(const World& world) {
  double greatest = 0.0, worst = 0.0;
  for (std::size_t l = 0; l < world.all<Link>().size(); ++l) {
    const LinkState& link = world.all<LinkState>()[l];
    for (const LinkState::Spring& spring : link.springs) {
      const Vec3 stretch = spring.displacements[1] + link.shift - spring.displacements[0];
      greatest = std::max(greatest, spring.force.norm());
      worst = std::max(worst, (spring.force - stretch / world.all<Link>()[l].softness).norm());
    }
  }
  return worst / greatest;
}

TEST(Links, ALiftedOrganLiftsTheOneThatItIsTiedTo) {
  const auto [tied, loose] = TiedAndLoose(400.0, 4e-3);
  ASSERT_TRUE(tied && loose);
  EXPECT_EQ(but_for_strain(step_until(*tied, 0.2)), FlagSet());
  EXPECT_EQ(but_for_strain(step_until(*loose, 0.2)), FlagSet());
  const Vec3 edge(-kRadius, 0, 0);
  EXPECT_GT(moved_near(*tied, 1, edge).z(), 0.02e-3);
  EXPECT_EQ(moved_near(*loose, 1, edge).norm(), 0.0);
  // The first pulls down less freely: the jaw feels more.
  EXPECT_GT(force_on(*tied, 0).norm(), force_on(*loose, 0).norm());
  ASSERT_EQ(tied->all<Link>().size(), 1u);
  EXPECT_GT(tied->all<LinkState>()[0].greatest_force, 1e-3);
  EXPECT_LT(misfit(*tied), 1e-3);
}

/// The lifted one of two tied balls at finite strain, or both.
std::unique_ptr<World> finite_balls(std::size_t finite, double lift, FiniteDescription settings) {
  SceneDescription scene = two_balls(400.0);
  for (std::size_t o = 0; o < finite; ++o) {
    scene.organs[o].response = Response::kFinite;
    scene.organs[o].finite = settings;
  }
  scene.instruments = {jaw("jaw", 0.0, {Vec3(0, 0, lift)})};
  return build(scene);
}

TEST(Links, OfOrgansAtFiniteStrainPullAsThoseOfLinearOnesWhereLittleMoves) {
  const FiniteDescription still{.quasi_static = true, .viscous_time = 0.0, .iterations = 20};
  const double lift = 0.1e-3;
  const auto linear = finite_balls(0, lift, still);
  ASSERT_TRUE(linear);
  step_until(*linear, 0.3);
  const double link = linear->all<LinkState>()[0].force, jaw = force_on(*linear, 0).norm();
  ASSERT_GT(link, 1e-4);
  for (const std::size_t finite : {1u, 2u}) {
    const auto world = finite_balls(finite, lift, still);
    ASSERT_TRUE(world);
    step_until(*world, 0.3);
    EXPECT_NEAR(world->all<LinkState>()[0].force / link, 1.0, 0.03) << finite;
    EXPECT_NEAR(force_on(*world, 0).norm() / jaw, 1.0, 0.03) << finite;
    EXPECT_LT(misfit(*world), 2e-3) << finite;
  }
}

TEST(Links, OfOrgansAtFiniteStrainHoldWhileTheySwing) {
  const auto world = finite_balls(2, 5e-3, {});
  ASSERT_TRUE(world);
  const Vec3 edge(-kRadius, 0, 0);
  for (const double time : {0.12, 0.16, 0.2, 0.3, 0.5}) {
    step_until(*world, time);
    EXPECT_LT(misfit(*world), 5e-3) << time;
  }
  EXPECT_GT(moved_near(*world, 1, edge).z(), 0.02e-3);
}

TEST(Links, AnOrganThatOnlyALinkReachesIsPreparedAndOneWithoutLinkIsNot) {
  const auto [tied, loose] = TiedAndLoose(400.0, 1e-3);
  ASSERT_TRUE(tied && loose);
  EXPECT_TRUE(tied->all<OrganBody>()[1].model->touchable_anywhere());
  EXPECT_FALSE(loose->all<OrganBody>()[1].model->touchable_anywhere());
}

TEST(Links, ALinkOfZeroStiffnessChangesNothingBitForBit) {
  const auto [slack, loose] = TiedAndLoose(0.0, 3e-3);
  ASSERT_TRUE(slack && loose);
  EXPECT_TRUE(!slack->has<Link>() && !slack->has<OrganTies>());
  EXPECT_EQ(hash_after(*slack, 0.2), hash_after(*loose, 0.2));
}

TEST(Links, AtRestTheyPullAtNothing) {
  auto scene = two_balls(1e4);
  scene.instruments = {jaw("jaw", 0.0, {})};
  scene.instruments[0].path = {{0.0, Vec3(0, 0, kHigh + 5e-3), 0.0, 1.0}};
  const auto world = build(scene);
  ASSERT_TRUE(world);
  EXPECT_EQ(but_for_strain(step_until(*world, 0.1)), FlagSet());
  for (const OrganState& organ : world->all<OrganState>()) EXPECT_FALSE(organ.deformed);
  EXPECT_EQ(world->all<LinkState>()[0].greatest_force, 0.0);
}

TEST(Links, WhatIsLetGoComesToRestAgain) {
  auto scene = two_balls(400.0);
  scene.instruments = {jaw("jaw", 0.0, {Vec3(0, 0, 4e-3), Vec3(0, 0, 4e-3)})};
  scene.instruments[0].path.push_back({0.4, Vec3(0, 0, kHigh + 10e-3), 0.0, 1.0});
  const auto world = build(scene);
  ASSERT_TRUE(world);
  step_until(*world, 0.3);
  EXPECT_TRUE(world->all<OrganState>()[1].deformed);
  step_until(*world, 0.5);
  for (const OrganState& organ : world->all<OrganState>()) EXPECT_FALSE(organ.deformed);
  EXPECT_EQ(world->all<LinkState>()[0].force, 0.0);
}

TEST(Links, StiffnessWithoutBoundEndsInOnePieceNotInAnExplosion) {
  double last = 0.0;
  for (const double stiffness : {1e2, 1e4, 1e6, 1e9}) {
    auto scene = two_balls(stiffness);
    // Both are pulled: the two problems are solved in turn.
    scene.instruments = {jaw("one", 0.0, {Vec3(0, 0, 3e-3), Vec3(2e-3, 0, 3e-3)}),
                         jaw("other", kApart, {Vec3(0, 0, -1e-3), Vec3(0, 2e-3, 1e-3)})};
    const auto world = build(scene);
    ASSERT_TRUE(world);
    EXPECT_EQ(but_for_strain(step_until(*world, 0.5)), FlagSet()) << stiffness;
    const double force = world->all<LinkState>()[0].force;
    EXPECT_TRUE(std::isfinite(force)) << stiffness;
    EXPECT_GT(force, last) << stiffness;
    EXPECT_LT(misfit(*world), stiffness < 1e5 ? 1e-3 : 1e9) << stiffness;
    for (const LinkState::Spring& spring : world->all<LinkState>()[0].springs) {
      const double stretch = (spring.displacements[0] - spring.displacements[1]).norm();
      EXPECT_LT(stretch, stiffness >= 1e6 ? 5e-6 : 1e-2) << stiffness;
    }
    if (stiffness > 1e7) {
      EXPECT_NEAR(force, last, 0.02 * force);
    }
    last = force;
  }
}

TEST(Links, PullingOneAtTheOtherIsPullingTheOtherAtTheOne) {
  // Betti: a jaw holds each ball; the force on the other's jaw when one moves along a is the force
  // on the one's, along a, when the other moves along that force.
  const Vec3 x = 1e-3 * Vec3::UnitX(), y = 1e-3 * Vec3::UnitY(), z = 1e-3 * Vec3::UnitZ();
  const Vec3 home = Vec3::Zero();
  for (const double stiffness : {300.0, 1e5}) {
    // In one world, since the nodes follow the tools' paths.
    auto scene = two_balls(stiffness);
    scene.instruments = {
        jaw("one", 0.0, {x, home, y, home, z, home, home, home, home, home, home, home}),
        jaw("other", kApart, {home, home, home, home, home, home, x, home, y, home, z, home})};
    const auto world = build(scene);
    ASSERT_TRUE(world);
    Mat3 there, back;
    for (int a = 0; a < 3; ++a) {
      step_until(*world, 0.2 + 0.2 * a);
      there.col(a) = force_on(*world, 1);
    }
    for (int a = 0; a < 3; ++a) {
      step_until(*world, 0.8 + 0.2 * a);
      back.col(a) = force_on(*world, 0);
    }
    EXPECT_GT(there.norm(), 1e-4);
    EXPECT_LT((there - back.transpose()).norm(), 1e-3 * there.norm()) << stiffness;
  }
}

TEST(Links, NoEnergyComesFromClosedPathsOfTwoJaws) {
  for (const double stiffness : {300.0, 1e7}) {
    auto scene = two_balls(stiffness);
    const double d = 3e-3;
    scene.instruments = {
        jaw("one", 0.0, {Vec3(0, 0, d), Vec3(d, 0, d), Vec3(d, d, 0), Vec3(0, 0, 0)}),
        jaw("other", kApart, {Vec3(d, 0, 0), Vec3(0, d, d), Vec3(-d, 0, d), Vec3(0, 0, 0)})};
    const auto world = build(scene);
    ASSERT_TRUE(world);
    step_until(*world, 0.1);
    std::array<Vec3, 2> tips, forces;
    const auto look = [&] {
      for (std::size_t i = 0; i < 2; ++i) {
        tips[i] = world->all<InstrumentState>()[i].tip;
        forces[i] = -force_on(*world, i);
      }
    };
    look();
    double work = 0.0, most = 0.0;
    for (int frame = 0; frame < 30; ++frame) {
      const auto old_tips = tips;
      const auto old_forces = forces;
      step_until(*world, world->time() + 1e-3);
      look();
      for (std::size_t i = 0; i < 2; ++i)
        work += 0.5 * (forces[i] + old_forces[i]).dot(tips[i] - old_tips[i]);
      most = std::max(most, work);
    }
    EXPECT_LT((tips[0] - Vec3(0, 0, kHigh)).norm(), 1e-9);
    EXPECT_GT(most, 1e-5);
    EXPECT_LT(std::abs(work), 2e-3 * most) << stiffness;
  }
}

TEST(Links, TheTurnOfAnOrgansFrameDoesNotMatter) {
  // The same two balls, the second turned about the vertical: another grid of nodes, the same
  // physics.
  auto scene = two_balls(400.0);
  scene.instruments = {jaw("jaw", 0.0, {Vec3(0, 0, 4e-3)})};
  const auto straight = build(scene);
  scene.organs[1].pose.orientation =
      Quaternion(Eigen::AngleAxisd(0.5 * std::numbers::pi, Vec3::UnitZ()));
  const auto turned = build(scene);
  ASSERT_TRUE(straight && turned);
  step_until(*straight, 0.2);
  step_until(*turned, 0.2);
  const Vec3 one = moved_near(*straight, 1, Vec3(-kRadius, 0, 0));
  const Vec3 other = moved_near(*turned, 1, Vec3(0, kRadius, 0));
  const Vec3 in_world = turned->all<OrganPose>()[1].pose.direction_to_world(other);
  EXPECT_LT((in_world - one).norm(), 0.1 * one.norm());
  EXPECT_NEAR(turned->all<LinkState>()[0].force, straight->all<LinkState>()[0].force,
              0.05 * straight->all<LinkState>()[0].force);
}

TEST(Links, ATieToTheGroundHoldsAnOrganThatBreathes) {
  constexpr double kWay = 4e-3;
  auto scene = two_balls(1e5);
  scene.organs.pop_back();
  scene.extras.get<LinkDescriptions>()[0].between = {"ground", "one"};
  set_motion(scene.organs[0], {kWay, Vec3::UnitY(), 1.0, 0.0});
  const auto world = build(scene);
  ASSERT_TRUE(world);
  EXPECT_EQ(but_for_strain(step_until(*world, 0.5)), FlagSet());
  // In its frame the tied edge stays behind; what is far goes along.
  EXPECT_LT(moved_near(*world, 0, Vec3(kRadius, 0, 0)).y(), -0.5 * kWay);
  EXPECT_LT(moved_near(*world, 0, Vec3(-kRadius, 0, 0)).norm(), 0.3 * kWay);
  EXPECT_GT(world->all<LinkState>()[0].force, 0.05);
  step_until(*world, 1.0);
  EXPECT_LT(world->all<LinkState>()[0].force, 1e-3 * world->all<LinkState>()[0].greatest_force);
}

TEST(Links, AnOrganThatLinksAlonePullAtIsDrawnWithinFiveMicrometresOfItsPlace) {
  auto scene = two_balls(400.0);
  set_motion(scene.organs[0], {1e-3, Vec3::UnitY(), 1.0, 0.0});
  const auto world = build(scene);
  ASSERT_TRUE(world);
  const OrganState& state = world->all<OrganState>()[1];
  float worst = 0.0f, greatest = 0.0f;
  constexpr int kFrames = 60;
  for (int frame = 1; frame <= kFrames; ++frame) {
    EXPECT_EQ(but_for_strain(step_until(*world, frame / 60.0)), FlagSet());
    if (!state.pressed) continue;
    OrganTouch& touch = *world->find<OrganTouch>(world->all<OrganBody>().owner(1));
    std::vector<float> exact;
    touch.solver->place_displacements(
        world->find<OrganContact>(world->all<OrganBody>().owner(1))->response, exact);
    ASSERT_EQ(exact.size(), state.displacements.size());
    for (std::size_t i = 0; i < exact.size(); ++i) {
      worst = std::max(worst, std::abs(exact[i] - state.displacements[i]));
      greatest = std::max(greatest, std::abs(exact[i]));
    }
  }
  EXPECT_LT(worst, 5e-6f);
  EXPECT_GT(worst, 0.0f);
  EXPECT_GT(greatest, 20e-6f);
  EXPECT_LT(state.version, static_cast<std::uint64_t>(kFrames));
}

TEST(Links, OrgansThatBreatheTogetherFeelNothingAndOneThatBreathesPullsTheOther) {
  auto scene = two_balls(400.0);
  set_motion(scene.organs[0], {3e-3, Vec3::UnitY(), 1.0, 0.0});
  auto together = scene;
  set_motion(together.organs[1], *motion_of(together.organs[0]));
  const auto alone = build(scene), both = build(together);
  ASSERT_TRUE(alone && both);
  EXPECT_EQ(but_for_strain(step_until(*alone, 0.5)), FlagSet());
  EXPECT_EQ(but_for_strain(step_until(*both, 0.5)), FlagSet());
  EXPECT_EQ(both->all<LinkState>()[0].greatest_force, 0.0);
  EXPECT_GT(alone->all<LinkState>()[0].force, 1e-2);
  EXPECT_LT(moved_near(*alone, 0, Vec3(kRadius, 0, 0)).y(), 0.0);
  EXPECT_GT(moved_near(*alone, 1, Vec3(-kRadius, 0, 0)).y(), 0.0);
}

TEST(Links, AChainOfThreePassesAPullOn) {
  auto scene = two_balls(1e5);
  scene.organs.push_back(scene.organs[1]);
  scene.organs[2].name = "third";
  scene.organs[2].pose.position.x() = 2.0 * kApart;
  LinkDescription second_bed = links_of(scene)[0];
  second_bed.name = "second_bed";
  second_bed.between = {"third", "other"};
  second_bed.region.a.x() += kApart;
  scene.extras.get<LinkDescriptions>().push_back(second_bed);
  scene.instruments = {jaw("jaw", 0.0, {Vec3(0, 0, 4e-3), Vec3(0, 0, 4e-3)})};
  const auto world = build(scene);
  ASSERT_TRUE(world);
  ASSERT_EQ(world->one<LinkGroups>()->groups.size(), 1u);
  EXPECT_EQ(but_for_strain(step_until(*world, 0.3)), FlagSet());
  const double first = moved_near(*world, 1, Vec3(-kRadius, 0, 0)).norm();
  const double second = moved_near(*world, 2, Vec3(-kRadius, 0, 0)).norm();
  EXPECT_GT(second, 0.0);
  EXPECT_LT(second, first);
  for (const LinkState& link : world->all<LinkState>())
    for (const LinkState::Spring& spring : link.springs)
      EXPECT_LT((spring.displacements[0] - spring.displacements[1]).norm(), 0.05 * first);
}

TEST(Links, TwoRunsAgreeBitForBit) {
  auto scene = two_balls(1e3);
  scene.instruments = {jaw("one", 0.0, {Vec3(0, 0, 3e-3)}),
                       jaw("other", kApart, {Vec3(0, 2e-3, 0)})};
  const auto one = build(scene), other = build(scene);
  ASSERT_TRUE(one && other);
  EXPECT_EQ(hash_after(*one, 0.2), hash_after(*other, 0.2));
}

TEST(Links, ARegionWithoutSurfaceIsRefused) {
  auto scene = two_balls(1e3);
  scene.extras.get<LinkDescriptions>()[0].region.a.z() = 0.1;
  std::vector<std::string> warnings;
  const auto world =
      build_world(scene, test_tissues(), {project_file("assets"), false}, no_progress(), warnings);
  ASSERT_FALSE(world);
  EXPECT_NE(world.error().text().find("links/0/region: found"), std::string::npos)
      << world.error().text();
}

TEST(Links, ALocalOrganIsTiedLikeAnyOther) {
  auto scene = two_balls(400.0);
  scene.organs[1].response = Response::kLocal;
  scene.instruments = {jaw("jaw", 0.0, {Vec3(0, 0, 6e-3)})};
  auto world = build(scene);
  ASSERT_TRUE(world);
  EXPECT_EQ(but_for_strain(step_until(*world, 0.25)), FlagSet());
  EXPECT_GT(world->all<LinkState>()[0].force, 0.01);
  EXPECT_LT(misfit(*world), 1e-3);
  EXPECT_GT(moved_near(*world, 1, Vec3(-kRadius, 0, 0)).z(), 0.05e-3);
}

TEST(Links, LocalOrgansTiedStifflyOverAWideRegionSettleAndMoveNoFartherThanTheJaw) {
  for (const bool both : {false, true}) {
    auto scene = two_balls(1e5);
    LinkDescription link = links_of(scene)[0];
    link.region.radius *= 1.6;
    scene.extras.set(LinkDescriptions{link});
    scene.organs[1].response = Response::kLocal;
    if (both) scene.organs[0].response = Response::kLocal;
    scene.instruments = {jaw("jaw", 0.0, {Vec3(0, 0, 6e-3)})};
    auto world = build(scene);
    ASSERT_TRUE(world);
    EXPECT_EQ(but_for_strain(step_until(*world, 0.4)), FlagSet()) << both;
    for (const OrganState& state : world->all<OrganState>()) {
      EXPECT_LT(state.greatest_displacement, 9e-3) << both;
      EXPECT_GT(state.greatest_displacement, 0.0) << both;
    }
  }
}

}  // namespace
}  // namespace viscera::test
