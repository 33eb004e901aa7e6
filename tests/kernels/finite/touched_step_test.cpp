// Steps of a body that something touches, with conditions that a test can solve by hand.
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>

#include "engine/verification/lifted_body.h"
#include "kernels/finite/finite_limits.h"
#include "kernels/finite/secant_pairs.h"

namespace viscera {
namespace {

/// The grip of a lifted body, told as what any tool is: its points are cells that are held.
class GripAsTouch final : public FiniteTouch {
 public:
  GripAsTouch(const LiftedBody& body, const Vec3& moved)
      : body_(body), moved_(moved), groups_(body.body().cloud.size(), -1) {
    for (const int node : rows().nodes) groups_[static_cast<std::size_t>(node)] = 0;
  }

  std::size_t cells() const override { return rows().points(); }
  std::int32_t held() const override { return static_cast<std::int32_t>(cells()); }
  std::span<const int> groups() const override { return groups_; }
  void turn(const NodalRotations& rotations) override {
    const Mat3 turn = rotation_of(rotations, static_cast<std::size_t>(rows().nodes.front()));
    const auto size = static_cast<Eigen::Index>(3 * cells());
    MatrixX plain(size, size);
    for (Eigen::Index c = 0; c < size; ++c) plain.col(c) = displaced(body_.grip().columns.col(c));
    rotations_ = rotations;
    response_.resize(size, size);
    for (Eigen::Index i = 0; i < size; i += 3)
      for (Eigen::Index j = 0; j < size; j += 3)
        response_.block<3, 3>(i, j) = turn * plain.block<3, 3>(i, j) * turn.transpose();
  }
  const MatrixX& response() const override { return response_; }
  VectorX displaced(const VectorX& u) const override {
    VectorX at = VectorX::Zero(static_cast<Eigen::Index>(3 * cells()));
    for (std::size_t p = 0; p < cells(); ++p)
      for (std::size_t e = rows().begin[p]; e < rows().begin[p + 1]; ++e)
        at.segment<3>(static_cast<Eigen::Index>(3 * p)) +=
            rows().values[e] * u.segment<3>(3 * rows().nodes[e]);
    return at;
  }
  void add_loads(const VectorX& forces, VectorX& loads) const override {
    for (std::size_t p = 0; p < cells(); ++p)
      for (std::size_t e = rows().begin[p]; e < rows().begin[p + 1]; ++e)
        loads.segment<3>(3 * rows().nodes[e]) +=
            rows().values[e] * forces.segment<3>(static_cast<Eigen::Index>(3 * p));
  }
  VectorX displaced_by(const VectorX& loads) const override { return displaced(warped(loads)); }
  VectorX answer_to(const VectorX& forces) const override {
    VectorX loads = VectorX::Zero(static_cast<Eigen::Index>(3 * groups_.size()));
    add_loads(forces, loads);
    return warped(loads);
  }
  double begin(const VectorX& displaced) override {
    begun_ = displaced;
    double most = 0.0;
    for (Eigen::Index at = 0; at < displaced.size(); at += 3)
      most = std::max(most, (moved_ - displaced.segment<3>(at)).norm());
    return most;
  }
  bool solve(const VectorX& free, const MatrixX& more, double share, VectorX& forces) override {
    if (refuses_) return false;
    const VectorX wanted = moved_.replicate(static_cast<Eigen::Index>(cells()), 1);
    MatrixX rows = response_;
    if (more.size() > 0) rows += more;
    rows.diagonal().array() += 1e-7 * rows.trace() / static_cast<double>(rows.rows());
    forces = rows.ldlt().solve(begun_ + share * (wanted - begun_) - free);
    return true;
  }

  void refuse() { refuses_ = true; }

 private:
  const HeldRows& rows() const { return body_.grip().rows; }
  VectorX warped(const VectorX& loads) const {
    VectorX moved(loads.size());
    const auto count = static_cast<std::size_t>(loads.size());
    apply_warped(*body_.solver().factor(), rotations_, {loads.data(), count},
                 {moved.data(), count});
    return moved;
  }

  const LiftedBody& body_;
  Vec3 moved_;
  std::vector<int> groups_;
  NodalRotations rotations_;
  MatrixX response_;
  VectorX begun_;
  bool refuses_ = false;
};

const LiftedBody& lifted_body() {
  static const std::unique_ptr<LiftedBody> body = [] {
    auto made = LiftedBody::prepare({.spacing = 8e-3});
    EXPECT_TRUE(made) << (made ? "" : made.error().text());
    return std::move(*made);
  }();
  return *body;
}

TEST(TouchedStep, OfAGripIsThatOfTheGripsOwnStep) {
  const LiftedBody& body = lifted_body();
  const FiniteSolver converged = body.solver().with(60, 1e-12), few = body.solver().with(2, 2e-6);
  FiniteState exact = converged.at_rest(), one = exact, two = exact;
  double apart = 0.0, apart_of_few = 0.0, scale = 0.0;
  for (int step = 1; step <= 60; ++step) {
    const Vec3 moved = lifted(step / 60.0, 30e-3, 1.0);
    const GripTarget target = body.target(moved);
    const Vec3 force = LiftedBody::force(converged.step({&target, 1}, exact));
    GripAsTouch touch(body, moved);
    const Vec3 touched = LiftedBody::force(converged.step(touch, Vec3::Zero(), one));
    const Vec3 in_few = LiftedBody::force(few.step(touch, Vec3::Zero(), two));
    apart = std::max(apart, (touched - force).norm());
    apart_of_few = std::max(apart_of_few, (in_few - force).norm());
    scale = std::max(scale, force.norm());
  }
  EXPECT_GT(scale, 0.2);
  // Both end where a factor in single precision does; 1.5e-3 apart at most when this was written.
  EXPECT_LT(apart, 2e-3 * scale);
  EXPECT_LT(apart_of_few, 5e-3 * scale);
}

TEST(TouchedStep, ConditionsWithoutAnAnswerLeaveTheLastShapeAtRest) {
  const LiftedBody& body = lifted_body();
  FiniteState state = body.solver().at_rest();
  GripAsTouch touch(body, Vec3(0, 0, 4e-3));
  EXPECT_TRUE(body.solver().step(touch, Vec3::Zero(), state).answered);
  const std::vector<double> before = state.displacements;
  touch.refuse();
  const FiniteStep step = body.solver().step(touch, Vec3::Zero(), state);
  EXPECT_FALSE(step.answered);
  EXPECT_TRUE(step.forces.empty());
  EXPECT_EQ(state.displacements, before);
  EXPECT_EQ(state.velocities, std::vector<double>(before.size(), 0.0));
}

TEST(TouchedStep, UnderItsWeightABodyFallsAsAStoneInItsFirstStep) {
  const LiftedBody& body = lifted_body();
  FiniteState state = body.solver().at_rest();
  const Vec3 gravity(0.0, 0.0, -9.81);
  class None final : public FiniteTouch {
   public:
    explicit None(std::size_t nodes) : groups_(nodes, -1) {}
    std::size_t cells() const override { return 0; }
    std::int32_t held() const override { return 0; }
    std::span<const int> groups() const override { return groups_; }
    void turn(const NodalRotations&) override {}
    const MatrixX& response() const override { return response_; }
    VectorX displaced(const VectorX&) const override { return {}; }
    VectorX displaced_by(const VectorX&) const override { return {}; }
    VectorX answer_to(const VectorX&) const override { return {}; }
    void add_loads(const VectorX&, VectorX&) const override {}
    double begin(const VectorX&) override { return 0.0; }
    bool solve(const VectorX&, const MatrixX&, double, VectorX&) override { return true; }

   private:
    std::vector<int> groups_;
    MatrixX response_;
  } none(body.body().cloud.size());
  const FiniteStep step = body.solver().with(40, 1e-12).step(none, gravity, state);
  EXPECT_GT(step.iterations, 0) << "a body without energy isn't at its equilibrium";
  const double dt = body.solver().options().time_step;
  double farthest = 0.0;
  for (std::size_t i = 2; i < state.displacements.size(); i += 3)
    farthest = std::min(farthest, state.displacements[i]);
  // What holds it slows it down, so that no part of it falls faster than a stone.
  EXPECT_LT(farthest, -0.1 * 9.81 * dt * dt);
  EXPECT_GT(farthest, -1.05 * 9.81 * dt * dt);
}

TEST(TouchedStep, OptionsThatNoStepHasAreRefused) {
  const LiftedBody& body = lifted_body();
  const auto body_of = std::make_shared<const FiniteBody>(body.solver().body());
  const std::vector<double> volumes(body.body().cloud.size(), 1e-8);
  const auto refused = [&](FiniteOptions options, const std::string& why) {
    const auto made = FiniteSolver::prepared(body_of, volumes, options, body.solver().factor());
    ASSERT_FALSE(made) << why;
    EXPECT_TRUE(made.error().text().starts_with(why)) << made.error().text();
  };
  FiniteOptions options;
  options.time_step = 0.0;
  refused(options, "time step: found 0.000000 s, expected more than 0");
  options = {};
  options.density = -1.0;
  refused(options, "density: found -1.000000 kg/m3");
  options = {};
  options.viscous_time = std::nan("");
  refused(options, "viscous time: found nan s");
  options = {};
  options.iterations = 0;
  refused(options, "iterations: found 0 and 6");
  const auto few = FiniteSolver::prepared(body_of, std::span(volumes).first(3), FiniteOptions(),
                                          body.solver().factor());
  EXPECT_FALSE(few);
}

TEST(TouchedStep, TheChangeOfAResponseByPairsIsThatOfTheirInverse) {
  // H0 the unit matrix, three pairs of a quadratic function.
  const Eigen::Index n = 7;
  VectorX stiffness(n);
  for (Eigen::Index i = 0; i < n; ++i) stiffness[i] = 1.0 + 0.5 * static_cast<double>(i * i);
  SecantPairs pairs;
  for (int k = 0; k < 3; ++k) {
    VectorX s(n);
    for (Eigen::Index i = 0; i < n; ++i) s[i] = std::sin(static_cast<double>(1 + k + 3 * i));
    const VectorX y = stiffness.cwiseProduct(s);
    ASSERT_TRUE(pairs.add(s, y, y));
  }
  MatrixX rows(3, n);
  for (Eigen::Index r = 0; r < 3; ++r)
    for (Eigen::Index i = 0; i < n; ++i) rows(r, i) = std::cos(static_cast<double>(r + 2 * i));
  MatrixX exact(3, 3);
  for (Eigen::Index c = 0; c < 3; ++c) {
    const VectorX load = rows.row(c).transpose();
    exact.col(c) = rows * (pairs.apply(load, load) - load);
  }
  const MatrixX change = pairs.response_change([&](const VectorX& v) { return VectorX(rows * v); });
  EXPECT_LT((change - exact).norm(), 1e-12 * exact.norm());
}

TEST(TouchedStep, WhatAFurtherIterationGainsIsAShareOfTheEnergy) {
  EXPECT_EQ(residual_of(0.0, 0.0), 0.0);
  EXPECT_EQ(residual_of(1e-9, 0.0), 1.0);
  EXPECT_NEAR(residual_of(1e-9, -1e-3), 1e-6, 1e-11);
}

}  // namespace
}  // namespace viscera
