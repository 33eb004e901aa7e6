#include "kernels/paff/shape_functions.h"

#include <gtest/gtest.h>

#include "tests/kernels/paff/elastic_bodies.h"

namespace viscera {
namespace {

TEST(QuarticWeight, FallsFromOneToZeroWithFlatEnds) {
  EXPECT_DOUBLE_EQ(quartic_weight(0.0), 1.0);
  EXPECT_NEAR(quartic_weight(1.0), 0.0, 1e-15);
  EXPECT_DOUBLE_EQ(quartic_weight(1.5), 0.0);
  EXPECT_DOUBLE_EQ(quartic_weight(0.5), 1.0 - 6.0 / 4.0 + 8.0 / 8.0 - 3.0 / 16.0);
  EXPECT_DOUBLE_EQ(quartic_weight_derivative(0.0), 0.0);
  EXPECT_NEAR(quartic_weight_derivative(1.0), 0.0, 1e-15);
}

TEST(QuarticWeight, DerivativeMatchesDifferences) {
  for (double s = 0.05; s < 1.0; s += 0.1) {
    const double step = 1e-6;
    const double difference = (quartic_weight(s + step) - quartic_weight(s - step)) / (2.0 * step);
    EXPECT_NEAR(quartic_weight_derivative(s), difference, 1e-9) << s;
  }
}

class ShapeFunctionsInACube : public testing::Test {
 protected:
  test::Body body = test::jittered_cube(6, 0.3);
  ShapeFunctions shape{body.cloud, 1.8};
  Random random{3, 1};

  Vec3 anywhere(std::uint64_t i) const {
    return Vec3(random.uniform(3 * i), random.uniform(3 * i + 1), random.uniform(3 * i + 2)) -
           Vec3::Constant(0.5);
  }
};

TEST_F(ShapeFunctionsInACube, SumToOneAndReproduceLinearFields) {
  ShapeValues at;
  for (std::uint64_t i = 0; i < 200; ++i) {
    const Vec3 x = anywhere(i);
    ASSERT_TRUE(shape.evaluate(x, true, at));
    ASSERT_TRUE(std::is_sorted(at.nodes.begin(), at.nodes.end()));
    double sum = 0.0;
    Vec3 place = Vec3::Zero(), gradient_of_one = Vec3::Zero();
    Mat3 gradient_of_place = Mat3::Zero();
    for (std::size_t j = 0; j < at.nodes.size(); ++j) {
      const Vec3& node = body.cloud.positions[static_cast<std::size_t>(at.nodes[j])];
      sum += at.values[j];
      place += at.values[j] * node;
      gradient_of_one += at.gradients[j];
      gradient_of_place += node * at.gradients[j].transpose();
    }
    EXPECT_NEAR(sum, 1.0, 1e-12);
    EXPECT_LT((place - x).norm(), 1e-12);
    EXPECT_LT(gradient_of_one.norm(), 1e-10);
    EXPECT_LT((gradient_of_place - Mat3::Identity()).norm(), 1e-10);
  }
}

TEST_F(ShapeFunctionsInACube, ReproduceQuadraticFieldsWithQuadraticBasis) {
  const ShapeFunctions quadratic(body.cloud, 2.4, Basis::kQuadratic);
  const test::QuadraticField field;
  ShapeValues at;
  for (std::uint64_t i = 0; i < 100; ++i) {
    const Vec3 x = anywhere(i);
    ASSERT_TRUE(quadratic.evaluate(x, true, at));
    Vec3 value = Vec3::Zero();
    Mat3 gradient = Mat3::Zero();
    for (std::size_t j = 0; j < at.nodes.size(); ++j) {
      const Vec3 node = field(body.cloud.positions[static_cast<std::size_t>(at.nodes[j])]);
      value += at.values[j] * node;
      gradient += node * at.gradients[j].transpose();
    }
    EXPECT_LT((value - field(x)).norm(), 1e-11);
    EXPECT_LT((gradient - field.gradient(x)).norm(), 1e-9);
  }
}

class ShapeFunctionsOfABasis : public ShapeFunctionsInACube,
                               public testing::WithParamInterface<Basis> {};

TEST_P(ShapeFunctionsOfABasis, HaveGradientsThatMatchDifferencesOfTheValues) {
  const ShapeFunctions shape(body.cloud, GetParam() == Basis::kLinear ? 1.8 : 2.4, GetParam());
  const double step = 1e-5;
  ShapeValues at, ahead, behind;
  for (std::uint64_t i = 0; i < 20; ++i) {
    const Vec3 x = 0.9 * anywhere(i);
    ASSERT_TRUE(shape.evaluate(x, true, at));
    for (int axis = 0; axis < 3; ++axis) {
      ASSERT_TRUE(shape.evaluate(x + step * Vec3::Unit(axis), false, ahead));
      ASSERT_TRUE(shape.evaluate(x - step * Vec3::Unit(axis), false, behind));
      const auto value = [](const ShapeValues& values, int node) {
        const auto found = std::lower_bound(values.nodes.begin(), values.nodes.end(), node);
        if (found == values.nodes.end() || *found != node) return 0.0;
        return values.values[static_cast<std::size_t>(found - values.nodes.begin())];
      };
      for (std::size_t j = 0; j < at.nodes.size(); ++j) {
        const double difference =
            (value(ahead, at.nodes[j]) - value(behind, at.nodes[j])) / (2.0 * step);
        EXPECT_NEAR(at.gradients[j][axis], difference, 1e-5);
      }
    }
  }
}

INSTANTIATE_TEST_SUITE_P(LinearAndQuadratic, ShapeFunctionsOfABasis,
                         testing::Values(Basis::kLinear, Basis::kQuadratic));

TEST_F(ShapeFunctionsInACube, RefusesPointsThatTooFewNodesReach) {
  ShapeValues at;
  EXPECT_FALSE(shape.evaluate(Vec3(5.0, 0.0, 0.0), true, at));
  EXPECT_FALSE(shape.evaluate(Vec3(0.75, 0.75, 0.75), true, at));
}

TEST(ShapeFunctions, ReproduceTheBasisWhereOneNodeHardlyLeavesAPlane) {
  // The last pivot of the moment matrix is about the square of the height over the support. The
  // values then are as large as its inverse, and what they sum to is known to round-off of that.
  const Random random(4, 2);
  for (const double height : {1e-2, 1e-3, 1e-4}) {
    PointCloud cloud;
    for (std::uint64_t i = 0; i < 12; ++i)
      cloud.positions.emplace_back(random.uniform(2 * i) - 0.5, random.uniform(2 * i + 1) - 0.5,
                                   i == 0 ? height : 0.0);
    cloud.spacings.assign(12, 1.0);
    const ShapeFunctions fields(cloud, 1.8);
    const Vec3 x(0.05, -0.1, 0.2);
    ShapeValues at;
    ASSERT_TRUE(fields.evaluate(x, true, at)) << height;
    double sum = 0.0, size = 0.0, slopes = 0.0;
    Vec3 place = Vec3::Zero(), gradient_of_one = Vec3::Zero();
    Mat3 gradient_of_place = Mat3::Zero();
    for (std::size_t j = 0; j < at.nodes.size(); ++j) {
      const Vec3& node = cloud.positions[static_cast<std::size_t>(at.nodes[j])];
      sum += at.values[j];
      size += std::abs(at.values[j]);
      slopes += at.gradients[j].norm();
      place += at.values[j] * node;
      gradient_of_one += at.gradients[j];
      gradient_of_place += node * at.gradients[j].transpose();
    }
    EXPECT_NEAR(sum, 1.0, 1e-15 * size) << height;
    EXPECT_LT((place - x).norm(), 2e-15 * size) << height;
    EXPECT_LT(gradient_of_one.norm(), 4e-15 * slopes) << height;
    EXPECT_LT((gradient_of_place - Mat3::Identity()).norm(), 4e-15 * slopes) << height;
  }
}

TEST(ShapeFunctions, RefuseNodesInOnePlane) {
  PointCloud flat;
  for (int i = 0; i < 5; ++i) {
    for (int j = 0; j < 5; ++j) flat.positions.emplace_back(i, j, 0.0);
  }
  flat.spacings.assign(flat.size(), 1.0);
  ShapeValues at;
  EXPECT_FALSE(ShapeFunctions(flat, 1.8).evaluate(Vec3(2.1, 2.2, 0.1), true, at));
}

}  // namespace
}  // namespace viscera
