#include "kernels/paff/compact_factor.h"

#include <gtest/gtest.h>
#include <oneapi/tbb/global_control.h>

#include <cmath>

#include "engine/verification/bodies.h"
#include "kernels/paff/galerkin.h"

namespace viscera {
namespace {

/// A held cube with its factor, as it was made and in sixteen bits.
struct Cube {
  NodedBody body = jittered_cube(7, 0.2);
  SymmetricBlockMatrix stiffness;
  StiffnessFactor factor;
  CompactFactor compact;

  static Cube make(double poisson_ratio, double youngs_modulus = 10e3) {
    NodedBody body = jittered_cube(7, 0.2);
    auto system = GalerkinSystem::assemble(
        body.problem({youngs_modulus, poisson_ratio}, [](const Vec3& x) { return x.x() < -0.499; }),
        1.8, [](double, std::string_view) { return true; });
    EXPECT_TRUE(system);
    auto factor = StiffnessFactor::factor(system->stiffness(), body.cloud.positions);
    EXPECT_TRUE(factor);
    CompactFactor compact(factor->pack());
    return {std::move(body), system->stiffness(), std::move(*factor), std::move(compact)};
  }
  std::vector<double> load(double scale = 1.0) const {
    std::vector<double> b(3 * body.cloud.size());
    for (std::size_t i = 0; i < b.size(); ++i)
      b[i] = scale * std::sin(1.0 + 0.7 * static_cast<double>(i));
    return b;
  }
};

double dot(std::span<const double> x, std::span<const double> y) {
  double sum = 0.0;
  for (std::size_t i = 0; i < x.size(); ++i) sum += x[i] * y[i];
  return sum;
}

class CompactFactorOf : public testing::TestWithParam<double> {};

/// In the measure that a preconditioner is judged by: the energy of what is left.
TEST_P(CompactFactorOf, AnswersAsTheWholeOneToHalfAHundredthInEnergy) {
  const Cube cube = Cube::make(GetParam());
  const std::vector<double> b = cube.load();
  std::vector<double> exact(b.size()), x(b.size()), left(b.size());
  cube.factor.apply(b, exact);
  cube.compact.apply(b, x);
  for (std::size_t i = 0; i < b.size(); ++i) x[i] -= exact[i];
  cube.stiffness.multiply(x, left);
  EXPECT_LT(std::sqrt(dot(x, left)), 5e-3 * std::sqrt(dot(b, exact)));
  EXPECT_GT(dot(x, left), 0.0) << "sixteen bits leave a mark";
}

INSTANTIATE_TEST_SUITE_P(PoissonsRatio, CompactFactorOf, testing::Values(0.3, 0.45, 0.49));

TEST(CompactFactor, IsSymmetric) {
  const Cube cube = Cube::make(0.45);
  const std::vector<double> b = cube.load();
  std::vector<double> c(b.rbegin(), b.rend()), x(b.size()), y(b.size());
  cube.compact.apply(b, x);
  cube.compact.apply(c, y);
  EXPECT_NEAR(dot(c, x), dot(b, y), 1e-5 * std::sqrt(dot(b, x) * dot(c, y)));
}

TEST(CompactFactor, TakesLoadsAndStiffnessOfAnySize) {
  const Cube soft = Cube::make(0.45), stiff = Cube::make(0.45, 10e15);
  const std::vector<double> b = soft.load(), great = soft.load(1e60);
  std::vector<double> x(b.size()), of_great(b.size()), of_stiff(b.size());
  soft.compact.apply(b, x);
  soft.compact.apply(great, of_great);
  stiff.compact.apply(b, of_stiff);
  const double size = std::sqrt(dot(x, x));
  for (std::size_t i = 0; i < b.size(); ++i) {
    ASSERT_NEAR(of_great[i], 1e60 * x[i], 1e60 * 1e-5 * size);
    ASSERT_NEAR(of_stiff[i], 1e-12 * x[i], 1e-12 * 1e-3 * size);
  }
  std::vector<double> nothing(b.size(), 0.0);
  soft.compact.apply(nothing, x);
  EXPECT_EQ(x, nothing);
}

TEST(CompactFactor, HasTheSameBitsForAnyNumberOfThreads) {
  const Cube cube = Cube::make(0.45);
  const std::vector<double> b = cube.load();
  std::vector<double> many(b.size()), one(b.size());
  cube.compact.apply(b, many);
  const oneapi::tbb::global_control serial(oneapi::tbb::global_control::max_allowed_parallelism, 1);
  cube.compact.apply(b, one);
  EXPECT_EQ(one, many);
}

TEST(CompactFactor, TakesHalfTheRoomOfOneInSinglePrecision) {
  const Cube cube = Cube::make(0.45);
  EXPECT_LT(static_cast<double>(cube.compact.memory_bytes()),
            0.62 * static_cast<double>(cube.factor.factor_bytes()));
}

}  // namespace
}  // namespace viscera
