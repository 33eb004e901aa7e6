// Bodies that touch each other.
#include "kernels/contact/contact_island.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <memory>

#include "engine/verification/two_balls.h"
#include "kernels/base/progress.h"
#include "tests/kernels/contact/bodies.h"

namespace viscera {
namespace {

using test::block, test::kTissue, test::kTop;

TwoBalls& balls() {
  static const std::unique_ptr<TwoBalls> made = [] {
    auto prepared = TwoBalls::prepare({}, no_progress());
    EXPECT_TRUE(prepared) << (prepared ? "" : prepared.error().text());
    return std::move(*prepared);
  }();
  return *made;
}

TEST(ContactIsland, TwoBallsPressEachOtherAsHertzFound) {
  const auto give = give_of_base(balls().material(), kHemisphereRadius);
  ASSERT_TRUE(give);
  for (const double approach : {0.5e-3, 1e-3, 2e-3}) {
    const TwoBallsAnswer answer = balls().press(approach);
    const HertzAnswer exact = hertz_held(balls().material(), kHemisphereRadius, approach, *give);
    ASSERT_TRUE(answer.island.converged);
    EXPECT_NEAR(answer.force, exact.force, 0.04 * exact.force) << approach;
    EXPECT_NEAR(answer.radius, exact.radius, 0.10 * exact.radius) << approach;
    EXPECT_LT(answer.unbalanced, 1e-12);
    EXPECT_LT(answer.greatest_overlap, 1e-5 * approach);
  }
}

TEST(ContactIsland, BallsThatAreDraggedAlongEachOtherSlideAtTheirFriction) {
  const TwoBallsAnswer answer = balls().press(1e-3, 0.3, 5e-3);
  ASSERT_TRUE(answer.island.converged);
  EXPECT_NEAR(answer.drag, 0.3 * answer.force, 0.01 * 0.3 * answer.force);
  EXPECT_LT(answer.unbalanced, 1e-12);
  const TwoBallsAnswer stuck = balls().press(1e-3, 0.3, 0.02e-3);
  EXPECT_LT(stuck.drag, 0.5 * 0.3 * stuck.force);
}

/// The block under a ball tip, alone in an island.
class BlockInAnIsland : public testing::Test {
 protected:
  void SetUp() override { ASSERT_TRUE(block().ready); }

  IslandFigures solve(const std::vector<ContactCell>& cells, std::size_t own,
                      std::span<const Joint> joints) {
    auto share = contact.share(cells, own, solution, response);
    EXPECT_TRUE(share);
    const IslandBody body{share.get(), Mat3::Identity(), own};
    return island.solve({&body, 1}, joints, forces);
  }
  static std::vector<ContactCell> tip(double friction) {
    auto cells = test::plane_cells(Vec3(0, 0, kTop), 0.8e-3, 3, 8e-3, 1e-3);
    for (ContactCell& cell : cells) {
      cell.friction = friction;
      cell.displacement = Vec3(0.5e-3, 0, 0);
    }
    return cells;
  }
  /// Each cell pushed by what doesn't move.
  static std::vector<Joint> met_by_a_wall(const std::vector<ContactCell>& cells) {
    std::vector<Joint> joints;
    for (std::size_t k = 0; k < cells.size(); ++k) {
      Joint joint;
      joint.ends[0] = {0, static_cast<int>(k)};
      joint.direction = cells[k].direction;
      joint.depth = cells[k].depth;
      joint.displacement = cells[k].displacement;
      joint.friction = cells[k].friction;
      joints.push_back(joint);
    }
    return joints;
  }

  PatchContact contact{block().compliance, block().touch, kTissue};
  ContactSolution solution;
  ContactResponse response;
  ContactIsland island;
  std::vector<Vec3> forces;
};

TEST_F(BlockInAnIsland, AnswersAToolAsItDoesAlone) {
  for (const double friction : {0.0, 0.3}) {
    const auto cells = tip(friction);
    EXPECT_TRUE(solve(cells, cells.size(), {}).converged);
    PatchContact alone(block().compliance, block().touch, kTissue);
    ContactSolution expected;
    ContactResponse loads;
    alone.solve(cells, expected, loads);
    const double greatest = test::total_force(expected).norm();
    for (std::size_t k = 0; k < cells.size(); ++k) {
      EXPECT_LT((solution.forces[k] - expected.forces[k]).norm(), 1e-8 * greatest) << k;
      EXPECT_LT((contact.cell_displacements()[k] - alone.cell_displacements()[k]).norm(), 1e-11);
    }
    EXPECT_EQ(response.touched, loads.touched);
  }
}

TEST_F(BlockInAnIsland, WhatTheForcesDontBringTogetherTakesNoPart) {
  std::vector<ContactCell> cells = tip(0.0);
  const std::size_t under = cells.size();
  // Beside the tip the tissue sinks with what is under it.
  cells.push_back(cells.front());
  cells.back().position.x() += 5e-3;
  std::vector<Joint> joints = met_by_a_wall(cells);
  joints.back().direction = -joints.back().direction;
  for (const auto& [depth, takes_part] : {std::pair(-10e-3, false), std::pair(-1e-6, true)}) {
    joints.back().depth = depth;
    forces.clear();
    const IslandFigures figures = solve(cells, 0, joints);
    ASSERT_TRUE(figures.converged);
    EXPECT_EQ(figures.rows, static_cast<int>(cells.size()));
    EXPECT_EQ(figures.tried, static_cast<int>(under + (takes_part ? 1 : 0))) << depth;
    EXPECT_EQ(forces.back().norm() > 0.0, takes_part) << depth;
    EXPECT_GT(contact.cell_displacements().back().dot(joints.back().direction), depth - 1e-8);
  }
}

TEST_F(BlockInAnIsland, MeetsWhatDoesntMoveAsItMeetsATool) {
  for (const double friction : {0.0, 0.3}) {
    const auto cells = tip(friction);
    EXPECT_TRUE(solve(cells, cells.size(), {}).converged);
    const Vec3 by_tool = test::total_force(solution);
    const auto joints = met_by_a_wall(cells);
    forces.clear();
    EXPECT_TRUE(solve(cells, 0, joints).converged);
    EXPECT_LT((test::total_force(solution) - by_tool).norm(), 1e-8 * by_tool.norm());
    Vec3 sum = Vec3::Zero();
    for (const Vec3& force : forces) sum += force;
    EXPECT_LT((sum - by_tool).norm(), 1e-8 * by_tool.norm());
  }
}

TEST_F(BlockInAnIsland, ASpringPullsByItsStretch) {
  auto cells = test::plane_cells(Vec3(0, 0, kTop), 1e-3, 0, 0.0, 0.0);
  Joint spring;
  spring.ends[0] = {0, 0};
  spring.held = true;
  spring.softness = 1.0 / 40.0;
  spring.displacement = Vec3(1e-3, 0, 2e-3);
  EXPECT_TRUE(solve(cells, 0, {&spring, 1}).converged);
  const Vec3 stretch = spring.displacement - contact.cell_displacements()[0];
  EXPECT_LT((forces[0] - 40.0 * stretch).norm(), 1e-5 * forces[0].norm());
  EXPECT_GT(forces[0].z(), 0.0);
}

TEST_F(BlockInAnIsland, WhatItLeavesIsAStateToGoOnFrom) {
  const auto cells = tip(0.0);
  const auto joints = met_by_a_wall(cells);
  EXPECT_TRUE(solve(cells, 0, joints).converged);
  EXPECT_TRUE(contact.fits(contact.state()));
  const MatrixX each =
      MatrixX::Identity(static_cast<Eigen::Index>(7), static_cast<Eigen::Index>(7));
  EXPECT_TRUE(contact.hold_of_others(cells, 0, 7, each));
  // Its next solve begins anew.
  PatchContact alone(block().compliance, block().touch, kTissue);
  ContactSolution expected;
  ContactResponse loads;
  alone.solve(cells, expected, loads);
  contact.solve(cells, solution, response);
  EXPECT_EQ(solution.forces, expected.forces);
}

TEST_F(BlockInAnIsland, ACellThatIsntSoundIsntShared) {
  auto cells = tip(0.0);
  cells[3].area = -1.0;
  EXPECT_FALSE(contact.share(cells, cells.size(), solution, response));
  EXPECT_FALSE(solution.converged);
}

/// A cube of unknown forces between two bodies whose response is known by hand.
class SpringBody final : public SharedSolve {
 public:
  SpringBody(double softness, int questions) : response_(MatrixX::Identity(3, 3) * softness) {
    question_.free = VectorX::Zero(3);
    question_.response = &response_;
    question_.cells.resize(1);
    open_ = questions;
    question_.last = open_ == 0;
  }
  const SharedQuestion& question() const override { return question_; }
  void answer(const VectorX* forces) override {
    answered = forces != nullptr;
    // A body that goes on yields twice as easily.
    response_ *= 2.0;
    question_.last = --open_ == 0;
  }
  void end(const VectorX* forces, const MatrixX& backing) override {
    answered = forces != nullptr;
    if (forces) force = *forces;
    behind = backing;
  }
  bool answered = false;
  Vec3 force = Vec3::Zero();
  MatrixX behind;

 private:
  MatrixX response_;
  SharedQuestion question_;
  int open_ = 0;
};

TEST(ContactIsland, BodiesThatStopEarlierGiveWayWhileOthersGoOn) {
  SpringBody one(1.0, 2), other(2.0, 1);
  const std::array<IslandBody, 2> bodies = {IslandBody{&one, Mat3::Identity(), 0},
                                            IslandBody{&other, Mat3::Identity(), 0}};
  Joint joint;
  joint.ends = {Joint::End{0, 0}, Joint::End{1, 0}};
  joint.direction = Vec3::UnitX();
  joint.depth = 1.0;
  std::vector<Vec3> forces;
  ContactIsland island;
  const IslandFigures figures = island.solve(bodies, {&joint, 1}, forces);
  EXPECT_EQ(figures.questions, 3);
  // Softness of 4 each in the end.
  EXPECT_NEAR(forces[0].x(), 1.0 / 8.0, 1e-6);
  EXPECT_EQ(one.force, Vec3(-other.force));
  EXPECT_NEAR(one.behind(0, 0), 4.0, 1e-12);
}

/// Springs that give way three times as easily once they have been apart by more than `far`.
class GivingWay final : public YieldingJoints {
 public:
  explicit GivingWay(double far) : far_(far), softness_(MatrixX::Identity(2, 2)) {
    softness_(0, 1) = softness_(1, 0) = 0.5;
  }
  const MatrixX& softness() const override { return softness_; }
  bool follow(std::span<const Vec3> apart) override {
    apart_by = apart[0].norm();
    if (gave_way || !(apart_by > far_)) return false;
    softness_ *= 3.0;
    return gave_way = true;
  }
  double apart_by = 0.0;
  bool gave_way = false;

 private:
  double far_;
  MatrixX softness_;
};

TEST(ContactIsland, JointsThatYieldTogetherComeApartByTheirSharedSoftness) {
  for (const double far : {10.0, 0.1}) {
    SpringBody one(1.0, 0), other(2.0, 0);
    const std::array<IslandBody, 2> bodies = {IslandBody{&one, Mat3::Identity(), 0},
                                              IslandBody{&other, Mat3::Identity(), 0}};
    // Two joints from one cell to another are one of the sum of their forces.
    std::array<Joint, 2> joints;
    for (Joint& joint : joints) {
      joint.ends = {Joint::End{0, 0}, Joint::End{1, 0}};
      joint.held = true;
      joint.displacement = Vec3(0, 2.0, 0);
    }
    GivingWay layer(far);
    const JointsThatYield yielding{0, &layer};
    std::vector<Vec3> forces;
    ContactIsland island;
    const IslandFigures figures = island.solve(bodies, joints, forces, {&yielding, 1});
    ASSERT_TRUE(figures.converged);
    EXPECT_EQ(layer.gave_way, far < 1.0);
    EXPECT_EQ(figures.softer, far < 1.0 ? 1 : 0);
    const double times = far < 1.0 ? 3.0 : 1.0;
    // 2 = (1 + 2) 2 f + times (1 + .5) f.
    const double exact = 2.0 / (6.0 + 1.5 * times);
    EXPECT_NEAR(forces[0].y(), exact, 1e-5);
    EXPECT_NEAR(forces[1].y(), exact, 1e-5);
    EXPECT_EQ(one.force, Vec3(-other.force));
    EXPECT_NEAR(layer.apart_by, times * 1.5 * exact, 1e-5);
    EXPECT_NEAR(one.behind(1, 1), 4.0 * 2.0 + 3.0 * times, 1e-12) << "both joints end in its cell";
  }
}

TEST(ContactIsland, WhereNothingAnswersEachBodyGoesWithout) {
  SpringBody one(std::numeric_limits<double>::quiet_NaN(), 1), other(1.0, 0);
  const std::array<IslandBody, 2> bodies = {IslandBody{&one, Mat3::Identity(), 0},
                                            IslandBody{&other, Mat3::Identity(), 0}};
  Joint joint;
  joint.ends = {Joint::End{0, 0}, Joint::End{1, 0}};
  joint.depth = 1.0;
  std::vector<Vec3> forces;
  ContactIsland island;
  EXPECT_FALSE(island.solve(bodies, {&joint, 1}, forces).converged);
  EXPECT_FALSE(one.answered);
  EXPECT_FALSE(other.answered);
  EXPECT_EQ(forces[0], Vec3(Vec3::Zero()));
}

/// Eight bodies in a row, so many springs side by side from each to the next, all of which want
/// something else of them.
struct Row {
  explicit Row(int springs, double last_softness = 2.0) {
    for (int b = 0; b < 8; ++b)
      bodies.push_back(std::make_unique<SpringBody>(b == 7 ? last_softness : 1.0, b % 2));
    std::vector<IslandBody> row;
    for (const auto& body : bodies) row.push_back({body.get(), Mat3::Identity(), 0});
    std::vector<Joint> joints;
    for (int b = 0; b < 7; ++b)
      for (int k = 0; k < springs; ++k) {
        Joint joint;
        joint.ends = {Joint::End{b, 0}, Joint::End{b + 1, 0}};
        joint.held = true;
        joint.displacement = Vec3(0, 1.0 + b, 0);
        joint.softness = 0.6 * springs;
        joints.push_back(joint);
      }
    figures = ContactIsland().solve(row, joints, forces);
  }
  std::vector<std::unique_ptr<SpringBody>> bodies;
  std::vector<Vec3> forces;
  IslandFigures figures;
};

TEST(ContactIsland, ManyBodiesWithManyJointsAreAnsweredAsThoseWithFew) {
  const Row few(1), many(10);
  ASSERT_TRUE(few.figures.converged);
  ASSERT_TRUE(many.figures.converged);
  EXPECT_EQ(few.figures.residual, 0.0) << "one dense problem";
  EXPECT_GT(many.figures.residual, 0.0) << "by pairs";
  for (std::size_t b = 0; b < 8; ++b)
    EXPECT_LT((many.bodies[b]->force - few.bodies[b]->force).norm(), 1e-4) << b;
  EXPECT_GT(few.bodies[0]->force.norm(), 0.1);
}

TEST(ContactIsland, WhereNothingAnswersManyEachGoesWithout) {
  const Row row(10, std::numeric_limits<double>::quiet_NaN());
  EXPECT_FALSE(row.figures.converged);
  EXPECT_TRUE(std::isfinite(row.figures.residual));
  for (const auto& body : row.bodies) EXPECT_FALSE(body->answered);
  for (const Vec3& force : row.forces) EXPECT_EQ(force, Vec3(Vec3::Zero()));
}

}  // namespace
}  // namespace viscera
