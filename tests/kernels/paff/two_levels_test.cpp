#include "kernels/paff/two_levels.h"

#include <gtest/gtest.h>
#include <oneapi/tbb/global_control.h>

#include <algorithm>
#include <cmath>

#include "kernels/paff/galerkin.h"
#include "kernels/paff/preparation_cost.h"
#include "tests/kernels/paff/elastic_bodies.h"

namespace viscera {
namespace {

constexpr double kRadius = 25e-3;

/// A ball that stands on its bottom, with its stiffness assembled and in parts.
struct Ball {
  test::Body body;
  SymmetricBlockMatrix stiffness;
  RestStiffness parts;

  static Ball make(double spacing, double poisson_ratio = 0.45,
                   const std::function<void(ElasticProblem&)>& change = {}) {
    test::Body body =
        test::placed_body(test::icosphere(kRadius, 3), [spacing](const Vec3&) { return spacing; });
    ElasticProblem problem =
        body.problem({1e4, poisson_ratio}, [](const Vec3& x) { return x.z() < -0.8 * kRadius; });
    if (change) change(problem);
    auto system = GalerkinSystem::assemble(problem, 1.8, no_progress());
    EXPECT_TRUE(system);
    auto region = system->region([](const Vec3&) { return true; });
    auto hold = system->hold();
    EXPECT_TRUE(region && hold);
    RestStiffness parts = RestStiffness::assemble(body.cloud.size(), *region, *hold, {});
    return {std::move(body), system->stiffness(), std::move(parts)};
  }
  TwoLevels levels() const {
    auto made = TwoLevels::make(parts, body.cloud.positions, body.cloud.spacings);
    EXPECT_TRUE(made) << (made ? "" : made.error().text());
    return std::move(*made);
  }
  std::vector<double> load(double change = 0.7) const {
    std::vector<double> b(3 * body.cloud.size());
    for (std::size_t i = 0; i < b.size(); ++i)
      b[i] = std::sin(1.0 + change * static_cast<double>(i));
    return b;
  }
};

double dot(std::span<const double> x, std::span<const double> y) {
  double sum = 0.0;
  for (std::size_t i = 0; i < x.size(); ++i) sum += x[i] * y[i];
  return sum;
}

/// Of the product with the parts, over the length of that with the assembled stiffness.
double error_of_parts(const Ball& ball) {
  const std::vector<double> x = ball.load();
  std::vector<double> expected(x.size());
  ball.stiffness.multiply(x, expected);
  const std::vector<float> in(x.begin(), x.end());
  std::vector<float> out(x.size());
  ball.parts.multiply(in.data(), out.data(), 1);
  double off = 0.0;
  for (std::size_t i = 0; i < x.size(); ++i)
    off += std::pow(static_cast<double>(out[i]) - expected[i], 2);
  return std::sqrt(off / dot(expected, expected));
}

TEST(RestStiffness, MultipliesAsTheAssembledStiffness) {
  for (const double poisson_ratio : {0.3, 0.45, 0.49})
    EXPECT_LT(error_of_parts(Ball::make(5e-3, poisson_ratio)), 1e-5) << poisson_ratio;
}

TEST(RestStiffness, HasFibresAndModuliByPlaceAsTheAssembledStiffnessHas) {
  const auto change = [](ElasticProblem& problem) {
    problem.relative_modulus = [](const Vec3& x, double) { return x.z() > 0.0 ? 3.0 : 1.0; };
    problem.fibres = [](const Vec3& x, double) {
      return Fibres{Vec3(-x.y(), x.x(), kRadius).normalized(), x.z() < 0.5 * kRadius ? 5e4 : 0.0};
    };
  };
  EXPECT_LT(error_of_parts(Ball::make(5e-3, 0.45, change)), 1e-5);
}

TEST(RestStiffness, MultipliesManyColumnsAsOneByOne) {
  const Ball ball = Ball::make(6e-3);
  const std::vector<double> x = ball.load();
  std::vector<float> one(x.begin(), x.end()), product(x.size()), two(2 * x.size()),
      products(2 * x.size());
  ball.parts.multiply(one.data(), product.data(), 1);
  for (std::size_t i = 0; i < x.size(); ++i) two[2 * i] = one[i], two[2 * i + 1] = -one[i];
  ball.parts.multiply(two.data(), products.data(), 2);
  const float most = *std::ranges::max_element(product);
  for (std::size_t i = 0; i < x.size(); ++i) {
    EXPECT_NEAR(products[2 * i], product[i], 1e-5f * most);
    EXPECT_NEAR(products[2 * i + 1], -product[i], 1e-5f * most);
  }
}

TEST(RestStiffness, AStepAddsShearStiffnessAndInertia) {
  const Ball ball = Ball::make(6e-3, 0.3);
  ElasticRegion none;
  none.begin = {0};
  const std::size_t nodes = ball.body.cloud.size();
  SymmetricBlockMatrix hold;
  hold.width = 3;
  hold.pattern.row_begin.assign(nodes + 1, 0);
  const std::vector<double> inertia(nodes, 3.0);
  // A body of no tissue is its inertia alone.
  ElasticRegion point;
  point.nodes.resize(nodes);
  for (std::size_t node = 0; node < nodes; ++node) point.nodes[node] = static_cast<int>(node);
  point.begin = {0, nodes};
  point.weights = {0.0};
  point.point_nodes = point.nodes;
  point.gradients.assign(nodes, Vec3::Zero());
  const RestStiffness made =
      RestStiffness::assemble(nodes, point, hold, {.shear = 2.0, .stiff = 5.0, .inertia = inertia});
  std::vector<float> x(3 * nodes, 1.0f), y(3 * nodes);
  made.multiply(x.data(), y.data(), 1);
  for (const float value : y) EXPECT_FLOAT_EQ(value, 3.0f);
}

TEST(TwoLevels, ACycleIsSymmetric) {
  const Ball ball = Ball::make(4e-3);
  const TwoLevels levels = ball.levels();
  const std::vector<double> b = ball.load(), c = ball.load(0.01);
  std::vector<double> x(b.size()), y(b.size());
  levels.apply(b, x);
  levels.apply(c, y);
  EXPECT_NEAR(dot(c, x), dot(b, y), 2e-4 * std::sqrt(dot(b, x) * dot(c, y)));
}

TEST(TwoLevels, ACycleNeverGoesTooFarAndMostOfTheWayWhereTissueIsSmooth) {
  for (const double poisson_ratio : {0.3, 0.45, 0.49}) {
    const Ball ball = Ball::make(4e-3, poisson_ratio);
    const TwoLevels levels = ball.levels();
    EXPECT_LT(8 * levels.coarse_nodes(), levels.nodes());
    for (const double change : {3.0, 0.7, 0.01, 0.001}) {
      const std::vector<double> x = ball.load(change);
      std::vector<double> b(x.size()), found(x.size());
      ball.stiffness.multiply(x, b);
      levels.apply(b, found);
      const double share = dot(b, found) / dot(b, x);
      EXPECT_GT(share, change < 0.1 ? 0.8 : 0.0) << poisson_ratio << " " << change;
      EXPECT_LT(share, 1.0 + 1e-4) << poisson_ratio << " " << change;
    }
  }
}

TEST(TwoLevels, ConjugateGradientsEndWhereTheFactorDoes) {
  for (const double poisson_ratio : {0.45, 0.49}) {
    const Ball ball = Ball::make(4e-3, poisson_ratio);
    const auto factor = StiffnessFactor::factor(ball.stiffness, ball.body.cloud.positions);
    ASSERT_TRUE(factor);
    std::vector<double> exact(3 * ball.body.cloud.size(), 0.0);
    exact[3 * 7 + 2] = 1.0;  // a force on one node
    std::vector<float> columns(exact.begin(), exact.end());
    ASSERT_TRUE(factor->solve(ball.stiffness, exact, 1));
    ball.levels().solve(columns, 1);
    std::vector<double> off(exact.size());
    for (std::size_t i = 0; i < exact.size(); ++i)
      off[i] = static_cast<double>(columns[i]) - exact[i];
    EXPECT_LT(std::sqrt(dot(off, off)), 5e-3 * std::sqrt(dot(exact, exact))) << poisson_ratio;
  }
}

TEST(TwoLevels, HaveTheSameBitsOnOneThread) {
  const Ball ball = Ball::make(4e-3);
  const std::vector<double> b = ball.load();
  std::vector<double> many(b.size()), one(b.size());
  ball.levels().apply(b, many);
  const oneapi::tbb::global_control limit(oneapi::tbb::global_control::max_allowed_parallelism, 1);
  ball.levels().apply(b, one);
  EXPECT_EQ(many, one);
}

TEST(TwoLevels, TakeAnEarlierOnesFactorAndNoOthers) {
  const Ball ball = Ball::make(5e-3), other = Ball::make(7e-3);
  const TwoLevels levels = ball.levels();
  const auto again = TwoLevels::make(ball.parts, ball.body.cloud.positions,
                                     ball.body.cloud.spacings, levels.coarse());
  ASSERT_TRUE(again);
  const std::vector<double> b = ball.load();
  std::vector<double> x(b.size()), y(b.size());
  levels.apply(b, x);
  again->apply(b, y);
  EXPECT_EQ(x, y);
  EXPECT_FALSE(TwoLevels::make(ball.parts, ball.body.cloud.positions, ball.body.cloud.spacings,
                               other.levels().coarse()));
}

TEST(TwoLevels, OnPaperCostWhatTheyTake) {
  for (const double spacing : {3.4e-3, 2.6e-3}) {
    const Ball ball = Ball::make(spacing);
    const TwoLevels levels = ball.levels();
    const LevelsCost cost =
        levels_cost(ball.body.cloud, galerkin_formulation().coupling({1e4, 0.45}));
    const double entries = static_cast<double>(levels.coarse()->factor_bytes()) / sizeof(float);
    std::printf("%zu nodes, %zu coarse (%zu said), entries %.3f of those made\n", levels.nodes(),
                levels.coarse_nodes(), cost.coarse_nodes,
                static_cast<double>(cost.coarse.factor_entries) / entries);
    EXPECT_EQ(cost.coarse_nodes, levels.coarse_nodes());
    EXPECT_NEAR(static_cast<double>(cost.coarse.factor_entries) / entries, 1.0, 0.2);
  }
}

}  // namespace
}  // namespace viscera
