// An organ lifted by its end: the quasi-Newton step against converged ones, Newton's own, and the
// linear body where little moves.
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "engine/verification/lifted_body.h"
#include "kernels/paff/block_matrix.h"

namespace viscera {
namespace {

constexpr int kConverged = 40;  // iterations

std::unique_ptr<LiftedBody> prepared(const LiftedBodyOptions& options) {
  auto body = LiftedBody::prepare(options);
  EXPECT_TRUE(body.has_value()) << (body ? "" : body.error().text());
  return body ? std::move(*body) : nullptr;
}

/// The 90th percentile of how far a lift's forces are from converged ones.
double lift_error(double poisson_ratio, int iterations) {
  LiftedBodyOptions options;
  options.material.poisson_ratio = poisson_ratio;
  const auto body = prepared(options);
  const FiniteSolver few = body->solver().with(iterations, 2e-6),
                     many = body->solver().with(kConverged, 1e-11);
  FiniteState one = few.at_rest(), other = many.at_rest();
  std::vector<double> errors;
  FiniteStep last;
  for (int step = 1; step <= 90; ++step) {
    const Vec3 moved = lifted(step / 60.0, 30e-3, 1.5);
    GripTouch touch = body->held_at(moved, last), other_touch = body->held_at(moved);
    last = few.step(touch, one);
    const Vec3 force = LiftedBody::force(last),
               exact = LiftedBody::force(many.step(other_touch, other));
    errors.push_back((force - exact).norm() / std::max(1e-3, exact.norm()));
  }
  std::sort(errors.begin(), errors.end());
  return errors[errors.size() * 9 / 10];
}

TEST(Lift, OneIterationAStepMeetsConvergedForcesWithinHalfAPercent) {
  EXPECT_LT(lift_error(0.45, 1), 5e-3);
}

TEST(Lift, TwoIterationsDoSoWithinOnePercentNearlyIncompressible) {
  EXPECT_LT(lift_error(0.49, 2), 1e-2);
}

TEST(Lift, OfAMillimetreHasTheLinearForceToItsSquare) {
  LiftedBodyOptions options;
  options.solver.dynamic = false;
  const auto body = prepared(options);
  const FiniteSolver solver = body->solver().with(kConverged, 1e-12);
  for (const double height : {1e-5, 1e-4}) {
    FiniteState state = solver.at_rest();
    const Vec3 moved(0.0, 0.0, height);
    GripTouch touch = body->held_at(moved);
    const Vec3 force = LiftedBody::force(solver.step(touch, state)),
               linear = body->linear_force(moved);
    EXPECT_LT((force - linear).norm() / linear.norm(), 70.0 * height + 2e-4) << height;
  }
}

TEST(Lift, EquilibriumIsThatOfNewtonsMethod) {
  LiftedBodyOptions options;
  options.solver.dynamic = false;
  const auto body = prepared(options);
  const FiniteSolver solver = body->solver().with(200, 1e-13);
  FiniteState state = solver.at_rest();
  FiniteStep last;
  const Vec3 top = lifted(1.5, 30e-3, 1.5);
  for (int step = 1; step <= 6; ++step) {
    GripTouch touch = body->held_at(top * step / 6.0);
    last = solver.step(touch, state);
  }
  // Newton's step from there, with the exact tangent, under the same held points.
  const FiniteBody& tissue = solver.body();
  FiniteBody::Workspace workspace;
  std::vector<double> g(state.displacements.size(), 0.0);
  tissue.energy(state.displacements, g, workspace);
  const auto n = static_cast<Eigen::Index>(g.size());
  const HeldRows& rows = body->grip().rows;
  const auto m = static_cast<Eigen::Index>(3 * rows.points());
  // [T Phi^T; Phi 0] [step; -lambda] = [-g; 0]: T alone may be indefinite.
  MatrixX equations = MatrixX::Zero(n + m, n + m);
  each_upper_entry(
      tissue.tangent(state.displacements), 0.0, [&](std::size_t i, std::size_t j, double value) {
        const auto row = static_cast<Eigen::Index>(i), column = static_cast<Eigen::Index>(j);
        equations(row, column) = equations(column, row) = value;
      });
  for (std::size_t p = 0; p < rows.points(); ++p)
    for (std::size_t e = rows.begin[p]; e < rows.begin[p + 1]; ++e)
      for (Eigen::Index k = 0; k < 3; ++k) {
        const Eigen::Index row = n + 3 * static_cast<Eigen::Index>(p) + k,
                           column = 3 * rows.nodes[e] + k;
        equations(row, column) += rows.values[e];
        equations(column, row) += rows.values[e];
      }
  VectorX right = VectorX::Zero(n + m);
  right.head(n) = -Eigen::Map<const VectorX>(g.data(), n);
  const VectorX solved = equations.partialPivLu().solve(right);
  const VectorX step = solved.head(n), lambda = -solved.tail(m);
  EXPECT_LT(step.lpNorm<Eigen::Infinity>(), 2e-6);  // [m], of 30 mm
  Vec3 exact = Vec3::Zero();
  for (Eigen::Index p = 0; p < m; p += 3) exact += lambda.segment<3>(p);
  EXPECT_LT((LiftedBody::force(last) - exact).norm() / exact.norm(), 1e-3);
}

TEST(Lift, AnOrganThatIsLetGoSwingsBackAndComesToRest) {
  const auto body = prepared({});
  const FiniteSolver& solver = body->solver();
  FiniteState state = solver.at_rest();
  for (int step = 1; step <= 60; ++step) {
    GripTouch touch = body->held_at(lifted(step / 60.0, 20e-3, 1.0));
    solver.step(touch, state);
  }
  const auto greatest = [&] {
    double most = 0.0;
    for (const double u : state.displacements) most = std::max(most, std::abs(u));
    return most;
  };
  EXPECT_GT(greatest(), 18e-3);
  solver.step(state);
  EXPECT_GT(greatest(), 5e-3) << "tissue has mass: it doesn't snap back in a step";
  for (int step = 0; step < 180; ++step) EXPECT_FALSE(solver.step(state).lost);
  EXPECT_LT(greatest(), 0.2e-3);
}

TEST(Lift, JerksOfFiveCentimetresAStepLeaveNoStateBehind) {
  const auto body = prepared({});
  const FiniteSolver& solver = body->solver();
  FiniteState state = solver.at_rest();
  std::uint32_t draw = 12345;
  const auto random = [&] {
    draw = draw * 1664525u + 1013904223u;
    return 2.0 * draw / 4294967296.0 - 1.0;
  };
  for (int step = 0; step < 30; ++step) {
    GripTouch touch = body->held_at(50e-3 * Vec3(random(), random(), random()) / 1.8);
    solver.step(touch, state);
  }
  for (int step = 0; step < 200; ++step) solver.step(state);
  for (const double u : state.displacements) ASSERT_LT(std::abs(u), 0.5e-3);
}

TEST(Lift, AStepHasTheSameBitsWhenItIsTakenAgain) {
  const auto body = prepared({});
  FiniteState one = body->solver().at_rest();
  for (int step = 1; step <= 5; ++step) {
    GripTouch touch = body->held_at(lifted(step / 10.0, 30e-3, 1.0));
    body->solver().step(touch, one);
  }
  FiniteState other = one;
  GripTouch touch = body->held_at(lifted(0.6, 30e-3, 1.0));
  body->solver().step(touch, one);
  body->solver().step(touch, other);
  EXPECT_EQ(one.displacements, other.displacements);
  EXPECT_EQ(one.rotations, other.rotations);
}

}  // namespace
}  // namespace viscera
