// The answer of a deformed body to a few more loads, against its tangent put together and factored.
#include "kernels/finite/tangent_answer.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <cmath>

#include "engine/verification/lifted_body.h"
#include "tests/kernels/finite/finite_cube.h"
#include "tests/support/dense_matrix.h"

namespace viscera {
namespace {

TEST(TangentTimes, AVectorIsTheTangentPutTogetherTimesIt) {
  const Cube cube = Cube::make(0.45);
  const std::vector<double> u = random_vector(3 * cube.finite.nodes(), 0.02, 3);
  const MatrixX whole = dense(cube.finite.tangent(u));
  MatrixX directions(whole.rows(), 5);  // more than one batch
  for (Eigen::Index c = 0; c < directions.cols(); ++c) {
    const std::vector<double> one = random_vector(u.size(), 1.0, 7 + static_cast<unsigned>(c));
    directions.col(c) = Eigen::Map<const VectorX>(one.data(), whole.rows());
  }
  const PointTangents tangents = cube.finite.point_tangents(u);
  const MatrixX product = cube.finite.tangent_times(tangents, directions),
                expected = whole * directions;
  for (Eigen::Index c = 0; c < directions.cols(); ++c)  // single precision
    EXPECT_LT((product - expected).col(c).norm(), 1e-7 * expected.col(c).norm());
  EXPECT_EQ(product, cube.finite.tangent_times(tangents, directions, true)) << "two at once";
}

TEST(TangentTimes, IsWhatTheGradientOfChangedTissueChangesBy) {
  const Cube cube = Cube::make(0.45);
  TissueChange change;
  for (std::size_t q = 0; q < cube.finite.points(); ++q) {
    change.stiffness.push_back(1.0 + 0.01 * static_cast<double>(q % 50));
    change.shrinkage.push_back(0.002 * static_cast<double>(q % 30));
  }
  const ChangedTissue changed = cube.finite.changed(change);
  const std::vector<double> u = random_vector(3 * cube.finite.nodes(), 0.02, 4),
                            d = random_vector(u.size(), 1.0, 5);
  const auto n = static_cast<Eigen::Index>(u.size());
  const auto gradient = [&](double along) {
    std::vector<double> at = u;
    for (std::size_t i = 0; i < at.size(); ++i) at[i] += along * d[i];
    VectorX g = VectorX::Zero(n);
    FiniteBody::Workspace workspace;
    cube.finite.energy(at, {g.data(), at.size()}, workspace, {}, changed);
    return g;
  };
  constexpr double kStep = 1e-5;
  const VectorX expected = (gradient(kStep) - gradient(-kStep)) / (2.0 * kStep);
  const MatrixX product = cube.finite.tangent_times(cube.finite.point_tangents(u, changed),
                                                    Eigen::Map<const VectorX>(d.data(), n));
  EXPECT_LT((product.col(0) - expected).norm(), 1e-6 * expected.norm());
}

/// A bar that is lifted by 30 mm and held there, with loads about the middle of its top.
struct Lifted {
  std::unique_ptr<LiftedBody> body;
  FiniteState state;
  MatrixX tangent, rows;
  TangentLoads loads;
  HeldBody held;

  explicit Lifted(double height) {
    auto made = LiftedBody::prepare({.spacing = 8e-3});
    EXPECT_TRUE(made);
    body = std::move(*made);
    const FiniteSolver& solver = body->solver();
    state = solver.at_rest();
    FiniteStep step;
    for (int frame = 0; frame < 100; ++frame) {
      GripTouch touch = body->held_at(lifted(frame / 60.0, height, 1.0), step);
      step = solver.step(touch, state);
    }
    tangent = dense(solver.body().tangent(state.displacements));
    const Eigen::Index n = tangent.rows();
    const HeldRows& grip = body->grip().rows;
    rows = MatrixX::Zero(static_cast<Eigen::Index>(3 * grip.points()), n);
    for (std::size_t p = 0; p < grip.points(); ++p)
      for (std::size_t e = grip.begin[p]; e < grip.begin[p + 1]; ++e)
        rows.block<3, 3>(static_cast<Eigen::Index>(3 * p), 3 * grip.nodes[e]).diagonal().array() +=
            grip.values[e];
    const std::vector<Vec3>& nodes = body->body().cloud.positions;
    Vec3 least = nodes.front(), most = least;
    for (const Vec3& x : nodes) least = least.cwiseMin(x), most = most.cwiseMax(x);
    const Vec3 middle = 0.5 * (least + most), foot(middle.x(), middle.y(), most.z());
    VectorX weights(static_cast<Eigen::Index>(nodes.size()));
    for (std::size_t i = 0; i < nodes.size(); ++i)
      weights[static_cast<Eigen::Index>(i)] =
          std::exp(-0.5 * (nodes[i] - foot).squaredNorm() / (6e-3 * 6e-3));
    weights /= weights.sum();
    loads.loads = MatrixX::Zero(n, 3);
    for (Eigen::Index i = 0; i < weights.size(); ++i)
      loads.loads.block<3, 3>(3 * i, 0).diagonal().setConstant(weights[i]);
    loads.precondition = [this](std::span<const double> g, std::span<double> z) {
      body->solver().precondition(state.rotations, g, z);
    };
    loads.guess = preconditioned(loads.loads);
    const MatrixX columns = preconditioned(rows.transpose());
    held.rows = static_cast<std::size_t>(rows.rows());
    held.moved = [this](const MatrixX& x) { return MatrixX(rows * x); };
    held.loads = [this](const MatrixX& f) { return MatrixX(rows.transpose() * f); };
    held.answers = [columns](const MatrixX& f) { return MatrixX(columns * f); };
    const MatrixX response = rows * columns;
    held.response = 0.5 * (response + response.transpose());
    held.beyond = MatrixX::Identity(rows.rows(), rows.rows()) * (1e-3 * response.trace()) /
                  static_cast<double>(rows.rows());
    held.response += held.beyond;
  }

  MatrixX preconditioned(const MatrixX& of) const {
    MatrixX answers(of.rows(), of.cols());
    for (Eigen::Index c = 0; c < of.cols(); ++c) {
      const VectorX one = of.col(c);
      loads.precondition({one.data(), static_cast<std::size_t>(one.size())},
                         {answers.col(c).data(), static_cast<std::size_t>(one.size())});
    }
    return answers;
  }

  MatrixX exact() const {
    const Eigen::LDLT<MatrixX> factor(tangent);
    const MatrixX alone = factor.solve(loads.loads), columns = factor.solve(rows.transpose());
    const MatrixX apart = held.apart.size() > 0 ? held.apart : MatrixX::Zero(rows.rows(), 3);
    const MatrixX grip = rows * columns + held.beyond;
    const MatrixX forces = -grip.ldlt().solve(rows * alone + apart);
    const MatrixX moved = alone + columns * forces;
    return loads.loads.transpose() * moved + apart.transpose() * forces;
  }

  std::optional<TangentAnswer> answer(int rounds) const {
    return answer_of_tangent(body->solver().body(), state.displacements, {}, loads, held, rounds);
  }
};

/// The greatest share that is missing, in any direction.
double missing(const MatrixX& found, const MatrixX& exact) {
  return Eigen::GeneralizedSelfAdjointEigenSolver<MatrixX>(exact - found, exact)
      .eigenvalues()
      .cwiseAbs()
      .maxCoeff();
}

TEST(TangentAnswer, OfABarLiftedByThirtyMillimetresIsWithinTwoPercentAfterFourRounds) {
  const Lifted bar(30e-3);
  const MatrixX exact = bar.exact();
  std::vector<double> errors;
  for (int rounds = 1; rounds <= 4; ++rounds) {
    const auto answer = bar.answer(rounds);
    ASSERT_TRUE(answer);
    errors.push_back(missing(answer->response, exact));
    // Always too stiff, and the better the more rounds.
    EXPECT_GT(Eigen::SelfAdjointEigenSolver<MatrixX>(exact - answer->response).eigenvalues()[0],
              -1e-6 * exact.norm());
    if (rounds > 1) {
      EXPECT_LT(errors[errors.size() - 1], 0.6 * errors[errors.size() - 2]);
    }
  }
  EXPECT_GT(errors[0], 0.1);
  EXPECT_LT(errors[3], 0.02);
}

TEST(TangentAnswer, GoesOnFromAnAnswerThatWasRightAMomentAgo) {
  Lifted bar(30e-3);
  const MatrixX exact = bar.exact();
  for (int frame = 0; frame < 5; ++frame) {
    const auto answer = bar.answer(2);
    ASSERT_TRUE(answer);
    bar.loads.guess = answer->displacements;
    bar.loads.guessed_forces = answer->forces;
  }
  const auto answer = bar.answer(2);
  ASSERT_TRUE(answer);
  EXPECT_LT(missing(answer->response, exact), 5e-3);
}

TEST(TangentAnswer, KnowsWhatTheLoadsDoToTheHoldBeyondTheNodes) {
  Lifted bar(20e-3);
  bar.held.apart = 0.3 * bar.rows * bar.loads.guess;
  const MatrixX exact = bar.exact();
  const auto answer = bar.answer(6);
  ASSERT_TRUE(answer);
  EXPECT_LT(missing(answer->response, exact), 2e-3);
}

TEST(TangentAnswer, ThereIsNoneWhereTheTangentIsntPositive) {
  Lifted bar(0.0);
  // Crushed along its length, tissue buckles.
  const std::vector<Vec3>& nodes = bar.body->body().cloud.positions;
  for (std::size_t i = 0; i < nodes.size(); ++i)
    bar.state.displacements[3 * i] = -0.7 * nodes[i].x();
  bar.held = {};
  EXPECT_FALSE(bar.answer(3));
}

}  // namespace
}  // namespace viscera
