#include "kernels/finite/pulled_tissue.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include "tests/kernels/finite/finite_cube.h"

namespace viscera {
namespace {

Mat3 some_gradient() {
  Mat3 f;
  f << 1.2, 0.1, 0.0, -0.05, 0.9, 0.2, 0.03, 0.0, 1.05;
  return f;
}

class PointsOf : public testing::TestWithParam<double> {};

TEST_P(PointsOf, AnEvenDeformationHaveItAndItsChangeOfVolume) {
  const Cube cube = Cube::make(GetParam());
  const Mat3 f = some_gradient();
  const std::vector<PointDeformation> points =
      cube.finite.deformations(cube.moved([&](const Vec3& x) -> Vec3 { return f * x; }));
  ASSERT_EQ(points.size(), cube.finite.points());
  const bool averages = cube.finite.moduli().averaged > 0.0;
  EXPECT_EQ(averages, GetParam() > 0.4);
  for (const PointDeformation& point : points) {
    EXPECT_LT((point.gradient - f).norm(), 1e-5) << point.gradient;
    EXPECT_NEAR(point.dilatation, averages ? f.determinant() - 1.0 : 0.0, 1e-4);
  }
}

TEST_P(PointsOf, ABodyAreInTheOrderOfItsRegion) {
  const Cube cube = Cube::make(GetParam());
  const auto region = cube.system.region([](const Vec3&) { return true; });
  ASSERT_TRUE(region.has_value());
  // One that stretches more from place to place along x: consistent gradients are near its own.
  const std::vector<PointDeformation> points = cube.finite.deformations(
      cube.moved([](const Vec3& x) { return Vec3(x.x() + 0.1 * x.x() * x.x(), x.y(), x.z()); }));
  const std::vector<double> volumes = cube.finite.point_volumes();
  ASSERT_EQ(points.size(), region->size());
  ASSERT_EQ(volumes.size(), region->size());
  double off = 0.0;
  for (std::size_t q = 0; q < points.size(); ++q) {
    const double stretch = 1.0 + 0.2 * region->positions[q].x();
    off += std::abs(points[q].gradient(0, 0) - stretch) / static_cast<double>(points.size());
    EXPECT_NEAR(volumes[q], region->volume(q), 1e-12);
  }
  // In another order they would be off by 0.2 / 3, the mean distance of two places of the cube.
  EXPECT_LT(off, 0.03);
}
INSTANTIATE_TEST_SUITE_P(FiniteBody, PointsOf, testing::Values(0.3, 0.45));

TEST(PulledTissue, AStripsStressIsWhatItsEnergyGrowsBy) {
  const Cube cube = Cube::make(0.45, false);
  const LawModuli law = cube.finite.moduli();
  for (const double l : {1.05, 1.38, 1.7, 0.7}) {
    const double volume =
        1.0 + law.shear * (1.0 - 1.0 / l) / (law.lambda + law.averaged + law.shear);
    const double side = std::sqrt(volume / l);
    const auto energy = [&](double along, double across) {
      return cube.energy(cube.moved(
          [&](const Vec3& x) { return Vec3(along * x.x(), across * x.y(), across * x.z()); }));
    };
    constexpr double kStep = 1e-4;
    const double pull = (energy(l + kStep, side) - energy(l - kStep, side)) / (2.0 * kStep),
                 push = (energy(l, side + kStep) - energy(l, side - kStep)) / (2.0 * kStep);
    const double stress = pull * l / volume;  // the cube's volume is 1 at rest
    EXPECT_NEAR(strip_stress(law, l), stress, 1e-3 * std::abs(stress)) << l;
    EXPECT_LT(std::abs(push), 1e-3 * std::abs(pull)) << l;
    Mat3 f = Mat3::Identity() * side;
    f(0, 0) = l;
    EXPECT_NEAR(greatest_stress(law, {f, volume - 1.0}, l), strip_stress(law, l), 1e-9 * law.shear);
  }
  // Small strains: Young's modulus.
  EXPECT_NEAR(strip_stress(law, 1.0 + 1e-6), 10e3 * 1e-6, 1e-4 * 10e3 * 1e-6);
}

TEST(PulledTissue, TheGreatestStretchIsAlongItsDirectionAndWithinItsBound) {
  const Mat3 f = some_gradient();
  const PrincipalStretch most = greatest_stretch(f);
  EXPECT_NEAR((f * most.direction).norm(), most.stretch, 1e-12);
  EXPECT_GE(stretch_bound(f), most.stretch - 1e-12);
  for (const Vec3& along : {Vec3(1, 0, 0), Vec3(0, 1, 0), Vec3(0, 0, 1), Vec3(1, 1, 1)})
    EXPECT_LE((f * along.normalized()).norm(), most.stretch + 1e-12);
  // Of an even pull, or one along one axis alone, the bound is near or exact.
  EXPECT_NEAR(stretch_bound(1.3 * Mat3::Identity()), 1.3, 1e-7);
  EXPECT_NEAR(stretch_bound(Vec3(1.5, 0.8, 0.8).asDiagonal().toDenseMatrix()), 1.5, 1e-12);
}

}  // namespace
}  // namespace viscera
