#include "engine/simulation/tool_shape.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/shapes.h"

namespace viscera {
namespace {

const Vec3 kUp = Vec3::UnitZ();

ToolShape capsule(double radius, double length, const Vec3& shaft) {
  ToolShape shape;
  shape.kind = TipDescription::Shape::kCapsule;
  shape.radius = radius;
  shape.length = length;
  shape.shaft = shaft.normalized();
  return shape;
}

TEST(ToolShape, TheLowestPointOfABallIsItsSouthPole) {
  ToolShape ball;
  ball.radius = 2e-3;
  ball.tip = Vec3(1e-3, 0, 5e-3);
  EXPECT_NEAR(ball.lowest(Vec3(1e-3, 0, 0), kUp)->along, 3e-3, 1e-12);
  EXPECT_NEAR(ball.lowest(Vec3(2e-3, 0, 0), kUp)->along, 5e-3 - std::sqrt(3.0) * 1e-3, 1e-12);
  EXPECT_FALSE(ball.lowest(Vec3(4e-3, 0, 0), kUp));
}

TEST(ToolShape, ALyingCapsuleIsLevelAlongItsAxis) {
  const ToolShape bar = capsule(2e-3, 10e-3, Vec3::UnitX());
  for (double x = 0.0; x <= 10e-3; x += 1e-3)
    EXPECT_NEAR(bar.lowest(Vec3(x, 0, -1), kUp)->along, 1.0 - 2e-3, 1e-9);
  EXPECT_NEAR(bar.lowest(Vec3(-1e-3, 0, -1), kUp)->along, 1.0 - std::sqrt(3.0) * 1e-3, 1e-9);
  EXPECT_FALSE(bar.lowest(Vec3(13e-3, 0, -1), kUp));
}

TEST(ToolShape, AStandingCapsuleTouchesWithItsEnd) {
  const ToolShape bar = capsule(2e-3, 10e-3, Vec3::UnitZ());
  EXPECT_NEAR(bar.lowest(Vec3(0, 0, -1), kUp)->along, 1.0 - 2e-3, 1e-12);
}

TEST(ToolShape, ASlantedCapsuleIsTheHullOfItsBalls) {
  const ToolShape bar = capsule(2e-3, 10e-3, Vec3(1, 0.3, 1));
  for (double x = -1e-3; x < 9e-3; x += 0.7e-3) {
    const Vec3 at(x, 0.3 * x, 0.0);
    double expected = 1.0;
    bool met = false;
    for (double s = 0.0; s <= 1.0; s += 1e-4) {
      const Vec3 centre = s * bar.length * bar.shaft;
      const Vec3 across = (centre - at) - (centre - at).dot(kUp) * kUp;
      const double h2 = bar.radius * bar.radius - across.squaredNorm();
      if (h2 < 0.0) continue;
      met = true;
      expected = std::min(expected, (centre - at).dot(kUp) - std::sqrt(h2));
    }
    const auto lowest = bar.lowest(at, kUp);
    ASSERT_EQ(lowest.has_value(), met);
    if (met) {
      EXPECT_NEAR(lowest->along, expected, 2e-6);
    }
  }
}

TEST(ToolShape, ItsLowestPointHasTheToolsOwnNormal) {
  ToolShape ball;
  ball.radius = 2e-3;
  ball.tip = Vec3(1e-3, 0, 5e-3);
  EXPECT_LT((ball.lowest(Vec3(1e-3, 0, 0), kUp)->outward + kUp).norm(), 1e-12);
  const auto aside = ball.lowest(Vec3(2e-3, 0, 0), kUp);
  EXPECT_LT((aside->outward - Vec3(0.5, 0, -std::sqrt(0.75))).norm(), 1e-12);

  const ToolShape bar = capsule(2e-3, 10e-3, Vec3(1, 0, 1));
  // Beside the middle of its axis, 1 mm off, from a metre away: across the axis, a unit.
  const Vec3 outward = bar.lowest(Vec3(4e-3, 1e-3, -1), kUp)->outward;
  EXPECT_NEAR(outward.norm(), 1.0, 1e-12);
  EXPECT_NEAR(outward.dot(bar.shaft), 0.0, 1e-12);
  EXPECT_NEAR(outward.y(), 0.5, 1e-12);
  EXPECT_LT(outward.z(), 0.0);
}

TEST(ToolShape, AMeshTipFeelsLikeTheBallThatItIs) {
  InstrumentBody body;
  body.mesh = test::icosphere(2e-3, 4);
  std::vector<Vec3f> positions;
  for (const Vec3& v : body.mesh.vertices) positions.push_back(v.cast<float>());
  body.mesh_surface = std::make_unique<CollisionSurface>(body.mesh, positions);
  ToolShape mesh;
  mesh.kind = TipDescription::Shape::kMesh;
  mesh.tip = Vec3(5e-3, 1e-3, 20e-3);
  mesh.shaft = Vec3(0.3, 0.2, 1.0).normalized();
  mesh.side = mesh.shaft.cross(Vec3::UnitX()).normalized();
  mesh.body = &body;
  ToolShape ball;
  ball.tip = mesh.tip;
  ball.radius = 2e-3;
  for (double x = -1.5e-3; x < 1.6e-3; x += 0.5e-3) {
    const Vec3 at = mesh.tip + Vec3(x, 0.2e-3, -15e-3);
    ASSERT_TRUE(mesh.lowest(at, kUp));
    EXPECT_NEAR(mesh.lowest(at, kUp)->along, ball.lowest(at, kUp)->along, 2e-5);
    // A facet's normal is the ball's somewhere on it.
    EXPECT_LT((mesh.lowest(at, kUp)->outward - ball.lowest(at, kUp)->outward).norm(), 0.1);
  }
}

}  // namespace
}  // namespace viscera
