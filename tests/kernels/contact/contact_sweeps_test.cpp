// Contact between many bodies, by pairs of them.
#include "kernels/contact/contact_sweeps.h"

#include <gtest/gtest.h>

#include <limits>

#include "kernels/base/random.h"
#include "kernels/contact/frictional.h"
#include "kernels/contact/rise_to_positive.h"

namespace viscera {
namespace {

using Kind = ContactCondition::Kind;

/// Bodies one on the other on a floor, so many cells wide: each cell of a body touches the one
/// below it, all but the lowest body's touch another body's.
class Stack {
 public:
  Stack(int bodies, int cells, Kind kind, double friction, double heavy) {
    const Random random(5, 0);
    std::uint64_t draw = 0;
    const auto between = [&](double low, double high) {
      return low + (high - low) * random.uniform(draw++);
    };
    for (int b = 0; b < bodies; ++b) {
      const Eigen::Index n = 3 * 2 * cells;
      MatrixX part(n, n);
      for (Eigen::Index j = 0; j < n; ++j)
        for (Eigen::Index i = 0; i < n; ++i) part(i, j) = between(-1.0, 1.0);
      MatrixX response = part * part.transpose() / static_cast<double>(n);
      response.diagonal().array() += 1.0;
      // It goes as a whole, too.
      for (int axis = 0; axis < 3; ++axis) {
        VectorX whole = VectorX::Zero(n);
        for (Eigen::Index i = axis; i < n; i += 3) whole[i] = 1.0;
        response += heavy * whole * whole.transpose();
      }
      responses_.push_back(response);
    }
    for (int b = 0; b < bodies; ++b)
      for (int c = 0; c < cells; ++c) {
        const std::array<Vec3, 3> ways = {Vec3::UnitZ(), Vec3::UnitX(), Vec3::UnitY()};
        const int count = kind == Kind::kUnilateral ? 1 : 3;
        for (int w = 0; w < count; ++w) {
          const Vec3& along = ways[static_cast<std::size_t>(w)];
          IslandUnknown unknown;
          unknown.terms[0] = {b, c, along};
          if (b > 0) unknown.terms[1] = {b - 1, cells + c, -along};
          unknown.softness = 0.01 * c;
          unknowns.push_back(unknown);
        }
        for (int i = 0; i < (kind == Kind::kBilateral ? 3 : 1); ++i)
          conditions.push_back({kind, friction});
      }
    for (const MatrixX& response : responses_) responses.push_back(&response);
    wanted.resize(static_cast<Eigen::Index>(unknowns.size()));
    for (double& one : wanted) one = between(-0.5, 1.0);
  }

  MatrixX dense(double ridge) const {
    const auto n = static_cast<Eigen::Index>(unknowns.size());
    MatrixX matrix = MatrixX::Zero(n, n);
    for (Eigen::Index i = 0; i < n; ++i)
      for (Eigen::Index j = 0; j < n; ++j)
        for (const IslandTerm& row : unknowns[static_cast<std::size_t>(i)].terms)
          for (const IslandTerm& column : unknowns[static_cast<std::size_t>(j)].terms)
            if (row.body >= 0 && row.body == column.body)
              matrix(i, j) +=
                  row.along.dot(responses_[static_cast<std::size_t>(row.body)].block<3, 3>(
                                    3 * row.cell, 3 * column.cell) *
                                column.along);
    for (Eigen::Index i = 0; i < n; ++i)
      matrix(i, i) = (1.0 + ridge) * matrix(i, i) + unknowns[static_cast<std::size_t>(i)].softness;
    return matrix;
  }

  std::vector<const MatrixX*> responses;
  std::vector<IslandUnknown> unknowns;
  std::vector<ContactCondition> conditions;
  VectorX wanted;

 private:
  std::vector<MatrixX> responses_;
};

constexpr double kRidge = 1e-6, kTolerance = 1e-6;

TEST(ContactSweeps, AnswerWhatOneDenseProblemAnswers) {
  for (const auto& [kind, friction] :
       {std::pair(Kind::kUnilateral, 0.0), std::pair(Kind::kFriction, 0.3),
        std::pair(Kind::kBilateral, 0.0)}) {
    const Stack stack(5, 4, kind, friction, 0.2);
    VectorX expected;
    ASSERT_TRUE(FrictionSolver()
                    .solve(stack.dense(kRidge), stack.wanted, stack.conditions, expected)
                    .converged);
    ContactSweeps sweeps;
    VectorX x;
    const SweepFigures figures = sweeps.solve(stack.responses, stack.unknowns, stack.conditions,
                                              kRidge, kTolerance, stack.wanted, x);
    EXPECT_TRUE(figures.converged);
    EXPECT_EQ(figures.blocks, 5);
    EXPECT_GT(expected.cwiseAbs().maxCoeff(), 0.1);
    EXPECT_LT((x - expected).cwiseAbs().maxCoeff(), 1e-4 * expected.cwiseAbs().maxCoeff());
    // From the answer there is nothing left to do.
    const SweepFigures again = sweeps.solve(stack.responses, stack.unknowns, stack.conditions,
                                            kRidge, kTolerance, stack.wanted, x);
    EXPECT_LT(again.sweeps, 3);
    EXPECT_LT(again.sweeps, figures.sweeps);
  }
}

TEST(ContactSweeps, KnowBodiesThatArePressedTheOtherWayRound) {
  // Cell 0 of each on cell 0 of the other, told from either side.
  const MatrixX first = MatrixX::Identity(6, 6), second = 10.0 * MatrixX::Identity(6, 6);
  const std::vector<const MatrixX*> responses = {&first, &second};
  std::vector<IslandUnknown> unknowns(2);
  unknowns[0].terms = {IslandTerm{0, 0, Vec3::UnitZ()}, IslandTerm{1, 0, -Vec3::UnitZ()}};
  unknowns[1].terms = {IslandTerm{1, 0, Vec3::UnitX()}, IslandTerm{0, 0, Vec3::UnitY()}};
  const std::vector<ContactCondition> conditions(2, {Kind::kBilateral});
  const VectorX wanted = Vec2(1.0, 2.0);
  VectorX x;
  ASSERT_TRUE(
      ContactSweeps().solve(responses, unknowns, conditions, 0.0, kTolerance, wanted, x).converged);
  EXPECT_NEAR(x[0], 1.0 / 11.0, 1e-9);
  EXPECT_NEAR(x[1], 2.0 / 11.0, 1e-9);
}

TEST(ContactSweeps, KeepSignsAndConesWhateverIsLeft) {
  const Stack stack(40, 3, Kind::kFriction, 0.5, 1e4);
  VectorX x = VectorX::Constant(stack.wanted.size(), -7.0);
  const SweepFigures figures = ContactSweeps().solve(
      stack.responses, stack.unknowns, stack.conditions, kRidge, kTolerance, stack.wanted, x);
  EXPECT_FALSE(figures.converged) << "what each body does as a whole goes through all of them";
  EXPECT_GT(figures.residual, 1e-6);
  for (Eigen::Index i = 0; i < x.size(); i += 3) {
    EXPECT_GE(x[i], 0.0);
    EXPECT_LE(x.segment<2>(i + 1).norm(), (0.5 + 1e-12) * x[i]);
  }
}

TEST(ContactSweeps, LiftResponsesThatArentPositiveAsOneDenseProblemDoes) {
  // Two cells of a body that answers worse to both than to the one less the other.
  MatrixX response = MatrixX::Identity(6, 6);
  response(0, 3) = response(3, 0) = 1.2;
  const std::vector<const MatrixX*> responses = {&response};
  std::vector<IslandUnknown> unknowns(2);
  unknowns[0].terms[0] = {0, 0, Vec3::UnitX()};
  unknowns[1].terms[0] = {0, 1, Vec3::UnitX()};
  const std::vector<ContactCondition> conditions(2, {Kind::kBilateral});
  const VectorX wanted = Vec2(1.0, 0.8);
  MatrixX dense = MatrixX::Identity(2, 2) * (1.0 + kRidge);
  dense(0, 1) = dense(1, 0) = 1.2;
  const Rise rise = rise_to_positive(dense, kRidge);
  dense += rise.matrix;
  VectorX x;
  const SweepFigures figures =
      ContactSweeps().solve(responses, unknowns, conditions, kRidge, kTolerance, wanted, x);
  EXPECT_NEAR(figures.lifted, rise.share, 1e-12);
  EXPECT_GT(figures.lifted, 0.05);
  // One of the matrix's eigenvalues is the ridge: along it sweeps come on slowly, and say so.
  const double missed = (dense * x - wanted).cwiseAbs().maxCoeff();
  EXPECT_LT(missed, 1.1 * figures.residual * x.cwiseAbs().maxCoeff() + 1e-12);
  EXPECT_TRUE(x.allFinite());
}

TEST(ContactSweeps, RefuseTwoBodiesThatMeetInMoreThanAMatrixMayHold) {
  const MatrixX response = MatrixX::Identity(3, 3);
  const std::vector<const MatrixX*> responses = {&response};
  IslandUnknown unknown;
  unknown.terms[0] = {0, 0, Vec3::UnitZ()};
  const std::vector<IslandUnknown> unknowns(kMostDenseUnknowns + 1, unknown);
  const std::vector<ContactCondition> conditions(unknowns.size(), {Kind::kUnilateral});
  const VectorX wanted = VectorX::Ones(static_cast<Eigen::Index>(unknowns.size()));
  VectorX x;
  const SweepFigures figures =
      ContactSweeps().solve(responses, unknowns, conditions, kRidge, kTolerance, wanted, x);
  EXPECT_FALSE(figures.converged);
  EXPECT_EQ(figures.residual, 1.0);
}

TEST(ContactSweeps, GiveNoForcesWhereSomethingIsntFinite) {
  Stack stack(2, 2, Kind::kUnilateral, 0.0, 0.1);
  VectorX x;
  const auto expect_no_forces = [&] {
    const SweepFigures figures = ContactSweeps().solve(
        stack.responses, stack.unknowns, stack.conditions, kRidge, kTolerance, stack.wanted, x);
    EXPECT_FALSE(figures.converged);
    // Nor is whoever asks by the residual told that it is small.
    EXPECT_EQ(figures.residual, 1.0);
    EXPECT_TRUE(x.isZero(0.0));
  };
  const MatrixX broken = MatrixX::Constant(12, 12, std::numeric_limits<double>::quiet_NaN());
  stack.responses[1] = &broken;
  expect_no_forces();
  const MatrixX negative = -100.0 * MatrixX::Identity(12, 12);
  stack.responses[1] = &negative;
  expect_no_forces();
  stack = Stack(2, 2, Kind::kUnilateral, 0.0, 0.1);
  stack.wanted[1] = std::numeric_limits<double>::infinity();
  expect_no_forces();
}

}  // namespace
}  // namespace viscera
