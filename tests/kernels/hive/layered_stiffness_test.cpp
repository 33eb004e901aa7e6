#include "kernels/hive/layered_stiffness.h"

#include <gtest/gtest.h>

#include "engine/verification/bodies.h"
#include "kernels/contact/unilateral.h"

namespace viscera {
namespace {

constexpr IsotropicMaterial kTissue{10e3, 0.4};

struct Placed {
  HivePattern pattern;
  HiveNodes nodes;
  explicit Placed(int count) : pattern(count), nodes(pattern) {
    const auto surface = WalkableSurface::make(ringed_hemisphere(0.025, 40));
    EXPECT_TRUE(surface);
    EXPECT_EQ(nodes.place(pattern, *surface, surface->nearest(Vec3(0.003, 0, 0.0245)), 0.01, 0.01),
              HiveVerdict::kSound);
  }
};

TEST(LayeredStiffness, LinearFieldsAreExactOnABentHive) {
  for (const int count : {28, 80, 120}) {
    Placed hive(count);
    const int m = hive.pattern.ring_nodes(), free = hive.pattern.free_nodes();
    Mat3 slope;
    slope << 0.1, 0.4, -0.2, 0.3, -0.25, 0.15, 0.05, 0.35, 0.2;
    const Mat3 strain = 0.5 * (slope + slope.transpose());
    const Mat3 stress = kTissue.lame_lambda() * strain.trace() * Mat3::Identity() +
                        2.0 * kTissue.shear_modulus() * strain;
    MatrixX held = MatrixX::Zero(3 * hive.pattern.nodes(), 1), loads = MatrixX::Zero(3 * free, 1);
    for (int i = 0; i < hive.pattern.nodes(); ++i)
      held.block<3, 1>(3 * i, 0) = slope * hive.nodes.positions[static_cast<std::size_t>(i)];
    for (const auto& t : hive.pattern.triangles()) {
      const Vec3 a = hive.nodes.positions[static_cast<std::size_t>(t[0])];
      const Vec3 area = 0.5 * (hive.nodes.positions[static_cast<std::size_t>(t[1])] - a)
                                  .cross(hive.nodes.positions[static_cast<std::size_t>(t[2])] - a);
      for (const int corner : t)
        if (corner < free) loads.block<3, 1>(3 * corner, 0) += stress * area / 3.0;
    }
    LayeredStiffness stiffness(hive.pattern, 1);
    ASSERT_TRUE(stiffness.assemble(hive.pattern, hive.nodes.positions, kTissue, &held));
    ASSERT_TRUE(stiffness.solve(loads));
    const MatrixX expected = held.topRows(3 * free);
    // Two points a wedge don't integrate bent ones exactly; a rigid or linear field on straight
    // ones is (the next test).
    EXPECT_LT((loads - expected).norm(), 0.02 * expected.norm()) << count << ' ' << m;
  }
}

TEST(LayeredStiffness, RigidMotionOfThePeripheryCausesNoStress) {
  Placed hive(120);
  const int free = hive.pattern.free_nodes();
  MatrixX held = MatrixX::Zero(3 * hive.pattern.nodes(), 6), loads = MatrixX::Zero(3 * free, 6);
  for (int i = 0; i < hive.pattern.nodes(); ++i) {
    const Vec3& x = hive.nodes.positions[static_cast<std::size_t>(i)];
    for (int c = 0; c < 3; ++c) {
      held.block<3, 1>(3 * i, c) = Vec3::Unit(c);
      held.block<3, 1>(3 * i, 3 + c) = Vec3::Unit(c).cross(x) / 0.025;
    }
  }
  LayeredStiffness stiffness(hive.pattern, 6);
  ASSERT_TRUE(stiffness.assemble(hive.pattern, hive.nodes.positions, kTissue, &held));
  ASSERT_TRUE(stiffness.solve(loads));
  EXPECT_LT((loads - held.topRows(3 * free)).norm(), 1e-10 * loads.norm());
}

TEST(LayeredStiffness, CondensedComplianceIsSymmetricAndPositive) {
  Placed hive(80);
  const int b = 3 * hive.pattern.free_nodes();
  LayeredStiffness stiffness(hive.pattern, b);
  MatrixX compliance = MatrixX::Identity(b, b);
  ASSERT_TRUE(stiffness.assemble(hive.pattern, hive.nodes.positions, kTissue, nullptr));
  ASSERT_TRUE(stiffness.solve(compliance));
  EXPECT_LT((compliance - compliance.transpose()).norm(), 1e-11 * compliance.norm());
  EXPECT_GT(smallest_eigenvalue_ratio(compliance), 1e-3);
}

TEST(LayeredStiffness, RefusesLayersThatRunIntoEachOther) {
  Placed hive(80);
  LayeredStiffness stiffness(hive.pattern, 1);
  std::vector<Vec3> turned = hive.nodes.positions;
  for (Vec3& x : turned) x.z() = -x.z();
  EXPECT_FALSE(stiffness.assemble(hive.pattern, turned, kTissue, nullptr));
}

}  // namespace
}  // namespace viscera
