#include "kernels/contact/frictional.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "kernels/base/random.h"
#include "kernels/contact/cell_pattern.h"
#include "kernels/contact/half_space.h"
#include "kernels/contact/unilateral.h"

namespace viscera {
namespace {

constexpr double kPi = std::numbers::pi;
using Kind = ContactCondition::Kind;

/// Response of the cells of a pattern on a half-space; per cell first inward, then x, then y.
MatrixX half_space_response(const CellPattern& pattern, const IsotropicMaterial& material) {
  const HalfSpace half_space(material);
  Mat3 axes;  // columns: into the body, x, y; the surface faces -first
  axes << 0, 1, 0, 0, 0, 1, 1, 0, 0;
  const auto n = static_cast<Eigen::Index>(pattern.places.size());
  MatrixX matrix(3 * n, 3 * n);
  for (Eigen::Index k = 0; k < n; ++k) {
    for (Eigen::Index l = 0; l < n; ++l) {
      const Vec2 offset =
          pattern.places[static_cast<std::size_t>(k)] - pattern.places[static_cast<std::size_t>(l)];
      matrix.block<3, 3>(3 * k, 3 * l) =
          axes.transpose() *
          half_space.response(disc_to_disc(offset.norm(), std::sqrt(pattern.areas[0] / kPi)),
                              Vec3(offset.x(), offset.y(), 0.0), -Vec3::UnitZ()) *
          axes;
    }
  }
  return matrix;
}

/// A ball on a half-space through a hexagonal grid of cells.
struct PressedBall {
  IsotropicMaterial material;
  double radius, depth, friction;
  CellPattern pattern;
  MatrixX response;
  std::vector<ContactCondition> conditions;
  VectorX wanted, forces;
  FrictionSolver solver;

  PressedBall(double poisson_ratio, double mu, int rings)
      : material{1e4, poisson_ratio}, radius(5e-3), depth(0.2e-3), friction(mu) {
    const double contact = std::sqrt(radius * depth);
    pattern = hexagonal_grid(1.25 * contact / rings, rings);
    response = half_space_response(pattern, material);
    conditions.assign(pattern.places.size(), {Kind::kFriction, mu});
    wanted.setZero(response.rows());
    for (std::size_t k = 0; k < pattern.places.size(); ++k) {
      wanted[static_cast<Eigen::Index>(3 * k)] =
          depth - pattern.places[k].squaredNorm() / (2.0 * radius);
    }
  }
  /// Moves the ball sideways, slips added; returns the force on the half-space.
  Vec2 drag(const Vec2& step) {
    const Eigen::Index n = wanted.size() / 3;
    for (Eigen::Index k = 0; k < n; ++k) wanted.segment<2>(3 * k + 1) += step;
    const FrictionFigures figures = solver.solve(response, wanted, conditions, forces);
    EXPECT_TRUE(figures.converged) << figures.residual << " after " << figures.rounds;
    Vec2 sum = Vec2::Zero();
    const VectorX gaps = response * forces - wanted;
    for (Eigen::Index k = 0; k < n; ++k) {
      sum += forces.segment<2>(3 * k + 1);
      wanted.segment<2>(3 * k + 1) += gaps.segment<2>(3 * k + 1);
    }
    return sum;
  }
  double pressed() const { return forces(Eigen::seqN(0, forces.size() / 3, 3)).sum(); }
};

void expect_conditions_hold(const MatrixX& matrix, const VectorX& b, const VectorX& x,
                            std::span<const ContactCondition> conditions) {
  const VectorX w = matrix * x - b;
  const double force = x.cwiseAbs().maxCoeff();
  const double gap = matrix.diagonal().maxCoeff() * force;
  Eigen::Index i = 0;
  for (const ContactCondition& condition : conditions) {
    if (condition.kind == Kind::kBilateral) {
      EXPECT_NEAR(w[i], 0.0, 1e-7 * gap);
    } else {
      EXPECT_GE(x[i], 0.0);
      EXPECT_GE(w[i], -1e-7 * gap);
      EXPECT_NEAR(std::min(x[i] / force, w[i] / gap), 0.0, 1e-7);
    }
    if (condition.kind == Kind::kFriction) {
      const Vec2 drag = x.segment<2>(i + 1), slip = w.segment<2>(i + 1);
      const double limit = condition.friction * x[i];
      EXPECT_LE(drag.norm(), limit * (1.0 + 1e-12));
      // Slips only at the limit, and against the force.
      EXPECT_NEAR(drag.dot(slip), -limit * slip.norm(), 1e-7 * force * gap);
    }
    i += condition.unknowns();
  }
}

TEST(Friction, ConditionsHoldOnRandomProblems) {
  for (std::uint64_t seed = 1; seed <= 30; ++seed) {
    const Random random(seed, 3);
    std::uint64_t draw = 0;
    std::vector<ContactCondition> conditions;
    int n = 0;
    for (int k = 0; k < 12; ++k) {
      const ContactCondition condition{k % 4 == 1   ? Kind::kBilateral
                                       : k % 4 == 2 ? Kind::kUnilateral
                                                    : Kind::kFriction,
                                       random.uniform(draw++)};
      conditions.push_back(condition);
      n += condition.unknowns();
    }
    MatrixX root(n, n);
    for (int i = 0; i < n; ++i) {
      for (int j = 0; j < n; ++j) root(i, j) = random.normal(draw++);
    }
    const MatrixX matrix = root * root.transpose() + 0.3 * n * MatrixX::Identity(n, n);
    VectorX b(n), x;
    for (int i = 0; i < n; ++i) b[i] = random.normal(draw++);
    FrictionSolver solver;
    const FrictionFigures figures = solver.solve(matrix, b, conditions, x);
    ASSERT_TRUE(figures.converged) << "seed " << seed << ", residual " << figures.residual;
    expect_conditions_hold(matrix, b, x, conditions);
  }
}

TEST(Friction, WithoutFrictionItIsTheUnilateralProblem) {
  PressedBall ball(0.3, 0.0, 4);
  ball.drag(Vec2(0.1e-3, 0.0));
  const Eigen::Index n = ball.wanted.size() / 3;
  const MatrixX normal = ball.response(Eigen::seqN(0, n, 3), Eigen::seqN(0, n, 3));
  const VectorX depths = ball.wanted(Eigen::seqN(0, n, 3));
  std::vector<char> bilateral(static_cast<std::size_t>(n), 0), active(bilateral);
  VectorX expected;
  ASSERT_TRUE(UnilateralSolver().solve(normal, depths, bilateral, active, expected).converged);
  const VectorX pushed = ball.forces(Eigen::seqN(0, n, 3));
  EXPECT_LT((pushed - expected).norm(), 1e-8 * expected.norm());
  EXPECT_EQ(ball.forces(Eigen::seqN(1, n, 3)).norm(), 0.0);
}

TEST(Friction, ABallDraggedAsideFollowsCattaneoAndMindlin) {
  // [Mindlin1949], [Johnson1985] eq. 7.42: shift = 3 mu P (2 - nu) / (16 a G) (1 - (1 - Q / mu P)
  // ^(2/3)). At nu = 1/2 pressing doesn't drag; the formula leaves out the slip across the pull,
  // and a grid of 91 cells meets the edge of the contact to a cell: 4 % for both.
  PressedBall ball(0.499999, 0.4, 5);
  ball.drag(Vec2::Zero());
  const double pressed = ball.pressed(), limit = ball.friction * pressed;
  const double contact = std::sqrt(ball.radius * ball.depth);
  const double whole_slip = 3.0 * limit * (2.0 - ball.material.poisson_ratio) /
                            (16.0 * contact * ball.material.shear_modulus());
  double at = 0.0;
  for (const double share : {0.2, 0.5, 0.8}) {
    const Vec2 force = ball.drag(Vec2((share - at) * whole_slip, 0.0));
    at = share;
    EXPECT_NEAR(force.x() / limit, 1.0 - std::pow(1.0 - share, 1.5), 0.04) << share;
    EXPECT_NEAR(force.y() / limit, 0.0, 1e-6);
  }
  // Sliding, but not everywhere straight along the pull.
  const double sliding = ball.drag(Vec2(whole_slip, 0.0)).x() / limit;
  EXPECT_LE(sliding, 1.0 + 1e-9);
  EXPECT_NEAR(sliding, 1.0, 1e-3);
}

TEST(Friction, AClosedPathCostsEnergy) {
  for (const double nu : {0.0, 0.3, 0.45}) {
    PressedBall ball(nu, 0.3, 3);
    ball.drag(Vec2::Zero());
    double work = 0.0, spent = 0.0;
    Vec2 force = Vec2::Zero();
    constexpr int kSteps = 24;
    Vec2 before = Vec2::Zero();
    for (int lap = 0; lap < 2; ++lap) {
      // The first lap leaves the anchors where the second finds them again.
      work = spent = 0.0;
      for (int i = 1; i <= kSteps; ++i) {
        const double angle = 2.0 * kPi * i / kSteps;
        const Vec2 at(80e-6 * std::sin(angle), 40e-6 * (1.0 - std::cos(angle)));
        const Vec2 next = ball.drag(at - before);
        work += 0.5 * (next + force).dot(at - before);
        spent += std::abs(0.5 * (next + force).dot(at - before));
        force = next;
        before = at;
      }
      EXPECT_GT(work, 0.05 * spent) << "nu " << nu << ", lap " << lap;
    }
  }
}

/// So what lasts is the guess alone, which the caller keeps.
TEST(Friction, AFreshSolverAnswersAsOneThatHasSolvedBefore) {
  PressedBall ball(0.4, 0.3, 4);
  for (int step = 0; step < 5; ++step) {
    PressedBall other = ball;
    other.solver = FrictionSolver();
    const Vec2 way(step % 2 ? -20e-6 : 10e-6, 3e-6);
    EXPECT_EQ(ball.drag(way), other.drag(way));
    EXPECT_EQ(ball.forces, other.forces);
  }
}

TEST(Friction, GreatFrictionSticks) {
  PressedBall ball(0.3, 50.0, 3);
  for (Eigen::Index k = 0; k < ball.wanted.size() / 3; ++k) ball.wanted[3 * k] = 0.2e-3;
  ball.drag(Vec2(20e-6, 0.0));
  VectorX held = VectorX::Zero(ball.wanted.size());
  for (Eigen::Index k = 0; k < held.size() / 3; ++k) {
    held[3 * k] = 0.2e-3;
    held[3 * k + 1] = 20e-6;
  }
  const VectorX stuck = ball.response.llt().solve(held);
  EXPECT_LT((ball.forces - stuck).norm(), 1e-7 * stuck.norm());
}

TEST(Friction, WhatCannotBeSolvedIsReportedWithoutForces) {
  FrictionSolver solver;
  const std::vector<ContactCondition> conditions{{Kind::kFriction, 0.3}};
  VectorX x;
  MatrixX matrix = MatrixX::Identity(3, 3);
  VectorX b(3);
  b << 1, 0, std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(solver.solve(matrix, b, conditions, x).converged);
  EXPECT_EQ(x, VectorX::Zero(3));
  b << 1, 0, 0;
  matrix(0, 0) = -1.0;
  EXPECT_FALSE(solver.solve(matrix, b, conditions, x).converged);
  EXPECT_EQ(x, VectorX::Zero(3));
  // Pressing pulls the surface up through its neighbour: no force can hold both off.
  const std::vector<ContactCondition> two(2, {Kind::kUnilateral, 0.0});
  MatrixX hostile(2, 2);
  hostile << 1, -2, -2, 1;
  VectorX pair = VectorX::Ones(2), answer;
  EXPECT_FALSE(solver.solve(hostile, pair, two, answer).converged);
  EXPECT_EQ(answer, VectorX::Zero(2));
}

TEST(Friction, NothingWantedNeedsNoForce) {
  FrictionSolver solver;
  VectorX x;
  const std::vector<ContactCondition> conditions{{Kind::kFriction, 0.3}};
  EXPECT_TRUE(solver.solve(MatrixX::Identity(3, 3), VectorX::Zero(3), conditions, x).converged);
  EXPECT_EQ(x, VectorX::Zero(3));
}

}  // namespace
}  // namespace viscera
