// Tips with Coulomb friction: tissue clings to them, follows, and slips.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "engine/features/deformation/deformation_flags.h"
#include "engine/run/state_hash.h"
#include "tests/support/small_world.h"

namespace viscera::test {
namespace {

constexpr double kTop = 25e-3;    // pole of the ball [m]
constexpr double kRadius = 4e-3;  // of the tip [m]
constexpr double kDepth = 2e-3;
constexpr double kPressed = 0.3;  // the tip is down [s]

/// A tip that comes down on the pole, waits, goes `drag` aside and waits.
SceneDescription dragging(double friction, double drag, double seconds = 0.3,
                          double radius = kRadius, double depth = kDepth) {
  auto scene = soft_ball_scene(6e-3, 3.5e-3);
  const double high = kTop + radius + 1e-3, low = kTop + radius - depth;
  const double start = kPressed + 0.1;
  InstrumentDescription tool = straight_tool("tip", InstrumentKind::kProbe, radius,
                                             {{0.0, Vec3(0, 0, high), 0.0, 1.0},
                                              {kPressed, Vec3(0, 0, low), 0.0, 1.0},
                                              {start, Vec3(0, 0, low), 0.0, 1.0},
                                              {start + seconds, Vec3(drag, 0, low), 0.0, 1.0}});
  tool.friction = friction;
  scene.instruments = {tool};
  return scene;
}

/// The greatest share of its cone that a cell's drag takes; drags in newtons that no cone allows
/// count as more than one.
double greatest_share_of_cone(const World& world, double friction) {
  const OrganContact& contact = world.all<OrganContact>()[0];
  double greatest = 0.0;
  for (std::size_t k = 0; k < contact.cells.size(); ++k) {
    const Vec3& force = contact.solution.forces[k];
    const Vec3& way = contact.cells[k].direction;
    const double push = force.dot(way);
    const double drag = (force - push * way).norm();
    if (drag > 1e-9) greatest = std::max(greatest, drag / (friction * push));
  }
  return greatest;
}

/// Force that the tip puts on the tissue: along its contact's inward direction, and across.
struct Split {
  double push = 0.0;
  Vec3 drag = Vec3::Zero();
};
Split split_force(const World& world) {
  const CellRange& range = world.all<OrganTouch>()[0].ranges.at(0);
  const double push = -range.force.dot(range.outward);
  return {push, range.force + push * range.outward};
}

/// Mean displacement of the pressed cells, and the greatest that is drawn, along x [m].
double mean_drag(const World& world) {
  const OrganContact& contact = world.all<OrganContact>()[0];
  double sum = 0.0;
  int pressed = 0;
  for (std::size_t k = 0; k < contact.cells.size(); ++k) {
    if (contact.solution.forces[k].isZero(0.0)) continue;
    sum += world.all<OrganTouch>()[0].solver->cell_displacements()[k].x();
    ++pressed;
  }
  return sum / pressed;
}
double drawn_drag(const World& world) {
  double greatest = 0.0;
  const OrganState& state = world.all<OrganState>()[0];
  const auto& rest = world.all<OrganBody>()[0].model->rest_positions;
  for (std::size_t v = 0; v < rest.size(); ++v)
    greatest = std::max(greatest, static_cast<double>(state.positions[v].x() - rest[v].x()));
  return greatest;
}

TEST(FrictionOfATip, WithoutItForcesOnlyPressAndNothingClings) {
  auto world = build(dragging(0.0, 3e-3));
  ASSERT_TRUE(world);
  step_until(*world, 0.6);
  const OrganContact& contact = world->all<OrganContact>()[0];
  ASSERT_GT(contact.solution.touching, 3);
  for (std::size_t k = 0; k < contact.cells.size(); ++k)
    EXPECT_LT(contact.solution.forces[k].cross(contact.cells[k].direction).norm(),
              1e-15 + 1e-14 * contact.solution.forces[k].norm());
  EXPECT_TRUE(world->all<OrganTouch>()[0].clings.empty());
}

TEST(FrictionOfATip, NoCellDragsMoreThanItsConeAllows) {
  auto world = build(dragging(0.3, 4e-3));
  ASSERT_TRUE(world);
  while (world->time() < 0.8) {
    EXPECT_FALSE(step_until(*world, world->time() + 1.0 / 60.0).has(kContactNotConverged));
    EXPECT_LT(greatest_share_of_cone(*world, 0.3), 1.0 + 1e-6) << "at " << world->time() << " s";
  }
}

TEST(FrictionOfATip, TissueThatSticksFollowsTheTip) {
  const double drag = 1.5e-3;
  auto smooth = build(dragging(0.0, drag));
  auto rough = build(dragging(50.0, drag));
  ASSERT_TRUE(smooth && rough);
  step_until(*smooth, kPressed + 0.1);
  step_until(*rough, kPressed + 0.1);
  const double before = mean_drag(*rough);
  step_until(*smooth, 0.7);
  step_until(*rough, 0.7);
  EXPECT_NEAR((mean_drag(*rough) - before) / drag, 1.0, 0.02);
  EXPECT_GT(drawn_drag(*rough), 0.7 * drag);
  EXPECT_LT(drawn_drag(*smooth), 0.5 * drawn_drag(*rough));
  EXPECT_GT(split_force(*rough).drag.x(), 0.3 * split_force(*rough).push);
  // The tool feels it as drag against its way.
  EXPECT_LT(force_on(*rough, 0).x(), force_on(*smooth, 0).x() - 0.01);
}

TEST(FrictionOfATip, AStuckTipIsAsStiffAsideAsMindlinSays) {
  // [Mindlin1949]: a stuck contact of radius a gives way by (2 - nu) / (8 G a) aside; the radius is
  // that of [Hertz1882], sqrt(R' depth). The ball gives way as a whole too, about as a column of
  // its own section and height does in shear, h / (G A), and up to twice that with its bending. The
  // traction of a stuck contact has no bound at its edge, which 37 cells, a dozen of them pressed,
  // follow as a smaller contact would: 30 % too soft, 15 % with half the pitch.
  const double drag = 0.05e-3, radius = 2e-3, depth = 0.3e-3;
  auto world = build(dragging(50.0, drag, 0.3, radius, depth));
  ASSERT_TRUE(world);
  step_until(*world, kPressed + 0.1);
  const double before = force_on(*world, 0).x();
  step_until(*world, 0.75);
  const double compliance = drag / (before - force_on(*world, 0).x());
  const double shear_modulus = 10e3 / (2.0 * 1.45);
  const double touching = std::sqrt(depth / (1.0 / radius + 1.0 / kTop));
  const double local = (2.0 - 0.45) / (8.0 * shear_modulus * touching);
  const double column = 40e-3 / (shear_modulus * std::numbers::pi * kTop * kTop);
  EXPECT_GT(compliance, 0.95 * (local + column));
  EXPECT_LT(compliance, 1.4 * local + 2.0 * column);
}

TEST(FrictionOfATip, WhatSticksStaysStuckWhileTheTipWaits) {
  auto world = build(dragging(50.0, 1.5e-3));
  ASSERT_TRUE(world);
  step_until(*world, 0.75);
  const Vec3 early = force_on(*world, 0);
  step_until(*world, 2.75);  // 120 frames
  const Vec3 late = force_on(*world, 0);
  EXPECT_LT((late - early).norm(), 0.01 * early.norm())
      << early.transpose() << " -> " << late.transpose();
}

TEST(FrictionOfATip, ALongDragSlidesAtTheLimitOfFriction) {
  const double friction = 0.2;
  auto world = build(dragging(friction, 6e-3, 0.6));
  ASSERT_TRUE(world);
  step_until(*world, 0.95);
  // No cell can drag more along x than its own cone allows about what it presses; while all slide
  // that way, to 18 degrees, they drag hardly less.
  const OrganContact& contact = world->all<OrganContact>()[0];
  double drag = 0.0, limit = 0.0;
  for (std::size_t k = 0; k < contact.cells.size(); ++k) {
    const Vec3 &force = contact.solution.forces[k], &way = contact.cells[k].direction;
    drag += force.x();
    limit += force.dot(way) * (way.x() + friction * std::sqrt(1.0 - way.x() * way.x()));
  }
  RecordProperty("drag_over_limit", std::to_string(drag / limit));
  const Split force = split_force(*world);
  RecordProperty("drag_over_push", std::to_string(force.drag.norm() / force.push));
  EXPECT_LT(drag, (1.0 + 1e-6) * limit);
  EXPECT_GT(drag, std::cos(std::numbers::pi / 10.0) * limit);
  EXPECT_GT(force.drag.x(), 0.9 * friction * force.push);
}

TEST(FrictionOfATip, LettingGoForgetsWhatClung) {
  auto scene = dragging(50.0, 1.5e-3);
  auto& path = scene.instruments[0].path;
  const double high = kTop + kRadius + 3e-3, low = kTop + kRadius - kDepth;
  path.push_back({0.9, Vec3(1.5e-3, 0, high), 0.0, 1.0});
  path.push_back({1.0, Vec3(0, 0, high), 0.0, 1.0});
  path.push_back({1.3, Vec3(0, 0, low), 0.0, 1.0});
  auto world = build(scene);
  ASSERT_TRUE(world);
  step_until(*world, kPressed + 0.1);
  const Vec3 first = force_on(*world, 0);
  step_until(*world, 1.0);
  EXPECT_EQ(force_on(*world, 0), Vec3::Zero());
  EXPECT_TRUE(world->all<OrganTouch>()[0].clings.empty());
  EXPECT_EQ(world->all<OrganState>()[0].positions,
            world->all<OrganBody>()[0].model->rest_positions);
  step_until(*world, 1.4);
  EXPECT_LT((force_on(*world, 0) - first).norm(), 0.02 * first.norm());
}

TEST(FrictionOfATip, TwoRunsGiveTheSameStateAndTheHashKnowsWhatClings) {
  const auto scene = dragging(0.3, 3e-3);
  auto one = build(scene), other = build(scene);
  ASSERT_TRUE(one && other);
  step_until(*one, 0.6);
  step_until(*other, 0.6);
  const std::string hash = StateHash().finish(*one);
  EXPECT_EQ(hash, StateHash().finish(*other));
  ASSERT_FALSE(other->all<OrganTouch>()[0].clings.empty());
  other->all<OrganTouch>()[0].clings[0].spots[0].displacement.x() += 1e-9;
  EXPECT_NE(hash, StateHash().finish(*other));
}

}  // namespace
}  // namespace viscera::test
